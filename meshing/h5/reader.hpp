#pragma once

#include <Eigen/Core>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "meshing/h5/types.hpp"

namespace nbd::h5 {

/// Whether a path that a file names, relative to the file's folder, leads to that folder or below. By its
/// text alone, whatever links there are.
bool stays_in_folder(const std::filesystem::path& path);

/// Reads an nbdtree file. Every call throws std::runtime_error with path, item, what it holds and what was
/// allowed if something is missing, damaged, or of another type or shape. May be used from any thread, one at
/// a time.
class Reader {
 public:
    struct Impl;
    /// Refuses files of another format or of a newer version of this format.
    Reader(const std::filesystem::path& path, const Format& expected);
    /// Opens any nbdtree file.
    explicit Reader(const std::filesystem::path& path);
    ~Reader();
    Reader(Reader&&) noexcept;

    const std::filesystem::path& path() const noexcept;
    const Format& format() const noexcept;

    /// Whether a group, dataset or link has this name.
    bool has(const std::string& name) const;
    /// Sorted names in a group.
    std::vector<std::string> children(const std::string& group) const;
    bool is_group(const std::string& name) const;
    /// Whether write_text() wrote this dataset.
    bool is_text(const std::string& dataset) const;
    /// Target of a soft link; "" if `name` is not a soft link.
    std::string link_target(const std::string& name) const;

    /// Location of a virtual dataset's numbers; nullopt for other datasets. HDF5 reads zeros if a source file
    /// is missing, so the read functions below refuse virtual datasets: read their sources.
    std::optional<VirtualSource> virtual_source(const std::string& dataset) const;

    Shape shape(const std::string& dataset) const;
    /// Throws if the dataset holds none of our number types.
    Type type(const std::string& dataset) const;

    /// Reads all numbers of a dataset, row-major. Its type and shape must match exactly (`any` matches every
    /// length).
    template <Number T>
    std::vector<T> read(const std::string& dataset, const Shape& expected) const {
        std::vector<T> values(element_count(check(dataset, type_of<T>(), expected)));
        read_values(dataset, type_of<T>(), values.data());
        return values;
    }

    /// Reads a dataset [rows, cols]; [rows] if M is a column vector, where cols may be left out.
    template <class M>
    M matrix(const std::string& dataset, std::size_t rows, std::size_t cols = 1) const {
        using T = typename M::Scalar;
        constexpr bool vector = M::ColsAtCompileTime == 1;
        const Shape s = check(dataset, type_of<T>(), vector ? Shape{rows} : Shape{rows, cols});
        Eigen::Matrix<T, Eigen::Dynamic, vector ? 1 : Eigen::Dynamic,
                      vector ? Eigen::ColMajor : Eigen::RowMajor>
            values(s[0], vector ? 1 : static_cast<Eigen::Index>(s.back()));
        read_values(dataset, type_of<T>(), values.data());
        return values;
    }

    /// Reads rows begin .. begin + count - 1 along the first axis, which must exist. The dataset stays open
    /// until another one is read, so each chunk is decoded once.
    template <Number T>
    void read_rows(const std::string& dataset, std::size_t begin, std::size_t count, T* values) const {
        read_rows(dataset, type_of<T>(), begin, count, values);
    }
    /// Likewise numbers of a type that is known at run time.
    void read_rows(const std::string& dataset, Type type, std::size_t begin, std::size_t count,
                   void* values) const;

    /// Reads a text written by Writer::write_text().
    std::string read_text(const std::string& dataset) const;

    /// A text or a number that Writer::attribute() wrote. Refuses a whole number that T cannot hold.
    template <class T>
    T attribute(const std::string& object, const std::string& name) const {
        if constexpr (std::same_as<T, std::string>) {
            return text_attribute(object, name);
        } else if constexpr (std::floating_point<T>) {
            double value = 0;
            number_attribute(object, name, Type::float64, &value);
            return static_cast<T>(value);
        } else {
            std::conditional_t<std::same_as<T, std::uint64_t>, std::uint64_t, std::int64_t> value = 0;
            number_attribute(object, name, type_of<decltype(value)>(), &value);
            if constexpr (std::same_as<T, bool>)
                return value != 0;
            else if (std::in_range<T>(value))
                return static_cast<T>(value);
            refuse(object + " has " + std::to_string(value) + " as " + name,
                   std::to_string(std::numeric_limits<T>::min()) + " to " +
                       std::to_string(std::numeric_limits<T>::max()));
        }
    }
    bool has_attribute(const std::string& object, const std::string& name) const;
    /// Sorted names.
    std::vector<std::string> attributes(const std::string& object) const;
    /// A text or number attribute as text for a person.
    std::string attribute_text(const std::string& object, const std::string& name) const;

    /// Throws std::runtime_error "path: what; allowed: allowed".
    [[noreturn]] void refuse(const std::string& what, const std::string& allowed) const;

    /// Returns the shape. Throws unless type and shape are as expected and the file can hold that many
    /// numbers.
    Shape check(const std::string& dataset, Type type, const Shape& expected) const;

 private:
    std::string text_attribute(const std::string& object, const std::string& name) const;
    void number_attribute(const std::string& object, const std::string& name, Type type, void* value) const;
    void read_values(const std::string& dataset, Type type, void* values) const;

    std::unique_ptr<Impl> impl_;
};

}  // namespace nbd::h5
