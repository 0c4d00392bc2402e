#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "meshing/h5/types.hpp"

namespace nbd::h5 {

/// Reads a file of ours. Every call throws std::runtime_error with path, item, what it holds and what was
/// allowed, where something is missing, damaged, or of another type or shape. May be used from any thread,
/// one at a time.
class Reader {
 public:
    /// Refuses a file of another format or of a newer version of it.
    Reader(const std::filesystem::path& path, const Format& expected);
    /// Any file of ours.
    explicit Reader(const std::filesystem::path& path);
    ~Reader();
    Reader(Reader&&) noexcept;

    const std::filesystem::path& path() const noexcept;
    /// Items whose name begins with `name` lie under `stored` in this file, which an older release wrote.
    void rename(std::string name, std::string stored);
    const Format& format() const noexcept;

    /// Whether a group, dataset or link has this name.
    bool has(const std::string& name) const;
    /// Names in a group, sorted.
    std::vector<std::string> children(const std::string& group) const;
    bool is_group(const std::string& name) const;
    /// Whether a dataset is what write_text() writes.
    bool is_text(const std::string& dataset) const;
    /// Where a soft link points; "" where `name` is none.
    std::string link_target(const std::string& name) const;

    /// Where the numbers of a virtual dataset lie; none for others. HDF5 reads zeros where a source is
    /// missing, so the calls below refuse to read virtual datasets: read their sources.
    std::optional<VirtualSource> virtual_source(const std::string& dataset) const;

    Shape shape(const std::string& dataset) const;
    /// Throws where the dataset holds anything but one of our number types.
    Type type(const std::string& dataset) const;

    /// All numbers of a dataset of exactly this type and shape (`any` fits every length), row-major.
    template <Number T>
    std::vector<T> read(const std::string& dataset, const Shape& expected) const {
        std::vector<T> values(element_count(check(dataset, type_of<T>(), expected)));
        read_values(dataset, type_of<T>(), values.data());
        return values;
    }

    /// A dataset [rows, cols], or [rows] where M is a column vector, which then may leave cols out.
    template <class M>
    M matrix(const std::string& dataset, std::size_t rows, std::size_t cols = 1) const {
        using T = typename M::Scalar;
        constexpr bool vector = M::ColsAtCompileTime == 1;
        const Shape s = check(dataset, type_of<T>(), vector ? Shape{rows} : Shape{rows, cols});
        Eigen::Matrix<T, Eigen::Dynamic, vector ? 1 : Eigen::Dynamic,
                      vector ? Eigen::ColMajor : Eigen::RowMajor>
            values(static_cast<Eigen::Index>(s[0]), vector ? 1 : static_cast<Eigen::Index>(s.back()));
        read_values(dataset, type_of<T>(), values.data());
        return values;
    }

    /// Rows begin .. begin + count along the first axis, which must exist. The dataset stays open until
    /// another one is read, so that chunks are decoded once.
    template <Number T>
    void read_rows(const std::string& dataset, std::size_t begin, std::size_t count, T* values) const {
        read_some(dataset, type_of<T>(), begin, count, values);
    }

    /// What Writer::write_text() wrote.
    std::string read_text(const std::string& dataset) const;

    std::string text_attribute(const std::string& object, const std::string& name) const;
    double number_attribute(const std::string& object, const std::string& name) const;
    std::int64_t int_attribute(const std::string& object, const std::string& name) const;
    std::uint64_t uint_attribute(const std::string& object, const std::string& name) const;
    bool has_attribute(const std::string& object, const std::string& name) const;
    /// Names, sorted.
    std::vector<std::string> attributes(const std::string& object) const;
    /// The value of a text or number attribute, for people.
    std::string attribute_text(const std::string& object, const std::string& name) const;

    /// Throws std::runtime_error "path: what; allowed: allowed".
    [[noreturn]] void refuse(const std::string& what, const std::string& allowed) const;

    /// The shape, after type and shape were found to be as expected and small enough to be true.
    Shape check(const std::string& dataset, Type type, const Shape& expected) const;

 private:
    void read_values(const std::string& dataset, Type type, void* values) const;
    void read_some(const std::string& dataset, Type type, std::size_t begin, std::size_t count,
                   void* values) const;

    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace nbd::h5
