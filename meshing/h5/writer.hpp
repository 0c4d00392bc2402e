#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "meshing/h5/types.hpp"

namespace nbd::h5 {

/// Storage of a dataset. Both kinds have a Fletcher32 checksum per chunk.
enum class Packing {
    plain,   // for positions: their low bits are noise that deflate cannot shrink
    deflate  // shuffles bytes, then deflates: index arrays shrink 3 to 10 times
};

/// Writes an nbdtree file: HDF5 with root attributes format, format_version, program_version and units,
/// everything checksummed, no time stamps (the same content gives the same bytes). The file appears under its
/// name at commit(); see TemporaryFile. Names are paths such as "tets/nodes"; missing parent groups are
/// created. May be used from any thread, one at a time. Every call throws std::runtime_error with path and
/// reason if the disk fails (full, gone, denied).
class Writer {
 public:
    Writer(const std::filesystem::path& path, const Format& format);
    ~Writer();
    Writer(Writer&&) noexcept;

    void group(const std::string& name);

    /// values: row-major, element_count(shape) of them.
    template <Number T>
    void write(const std::string& name, const Shape& shape, std::span<const T> values,
               Packing packing = Packing::plain) {
        write_values(name, type_of<T>(), shape, values.data(), values.size(), packing);
    }

    /// Writes shape [values.size()].
    template <Number T>
    void write(const std::string& name, const std::vector<T>& values, Packing packing = Packing::plain) {
        write_values(name, type_of<T>(), {values.size()}, values.data(), values.size(), packing);
    }

    /// Writes shape [rows, cols], or [rows] if M is a column vector.
    template <class M>
    void write(const std::string& name, const Eigen::MatrixBase<M>& m, Packing packing = Packing::plain) {
        constexpr bool vector = M::ColsAtCompileTime == 1;
        using Stored = Eigen::Matrix<typename M::Scalar, Eigen::Dynamic, vector ? 1 : Eigen::Dynamic,
                                     vector ? Eigen::ColMajor : Eigen::RowMajor>;
        const Stored values = m;
        const std::size_t rows = m.rows(), cols = m.cols();
        write_values(name, type_of<typename M::Scalar>(), vector ? Shape{rows} : Shape{rows, cols},
                     values.data(), rows * cols, packing);
    }

    /// Writes a text of any length as a dataset of one string.
    void write_text(const std::string& name, std::string_view text);

    /// Writes a virtual dataset: h5py and other programs read the numbers of `source` through it.
    void write_virtual(const std::string& name, Type type, const Shape& shape, const VirtualSource& source);

    /// Makes a soft link: `name` reads as `target`.
    void link(const std::string& name, const std::string& target);

    /// object: an existing group or dataset; "/" is the file itself.
    template <class T>
    requires std::is_arithmetic_v<T>
    void attribute(const std::string& object, const std::string& name, T value) {
        if constexpr (std::is_floating_point_v<T>) {
            const auto v = static_cast<double>(value);
            number_attribute(object, name, Type::float64, &v);
        } else if constexpr (std::is_signed_v<T>) {
            const std::int64_t v = value;
            number_attribute(object, name, Type::int64, &v);
        } else {
            const std::uint64_t v = value;
            number_attribute(object, name, Type::uint64, &v);
        }
    }
    /// At most 32 KiB; use write_text() for longer texts.
    void attribute(const std::string& object, const std::string& name, std::string_view value);

    /// Starts a dataset [0, row...] that grows by append() and holds at most one chunk in memory. Returns a
    /// handle.
    int begin_growing(const std::string& name, Type type, const Shape& row, std::size_t rows_per_chunk,
                      Packing packing = Packing::plain);
    /// values: complete rows.
    template <Number T>
    void append(int handle, std::span<const T> values) {
        append_values(handle, type_of<T>(), values.data(), values.size());
    }
    void end_growing(int handle);

    /// Closes the file and moves it to its final name. Call once, last.
    void commit();

    const std::filesystem::path& path() const noexcept;

 private:
    void write_values(const std::string& name, Type type, const Shape& shape, const void* values,
                      std::size_t count, Packing packing);
    void number_attribute(const std::string& object, const std::string& name, Type type, const void* value);
    void append_values(int handle, Type type, const void* values, std::size_t count);

    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace nbd::h5
