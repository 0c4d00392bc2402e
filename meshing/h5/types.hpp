#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace nbd::h5 {

/// Format of a file: root attributes `format` and `format_version`. A program reads its own version and older
/// ones.
struct Format {
    std::string name;
    int version = 1;
};

/// The system could not read a file, which may be whole.
class ReadError : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Dimensions, slowest first, as in HDF5 and NumPy.
using Shape = std::vector<std::size_t>;

/// Matches every length in an expected shape.
inline constexpr std::size_t any = -1;

/// Number types of datasets.
enum class Type { float32, float64, int32, int64, uint64 };

template <class T>
concept Number = std::same_as<T, float> || std::same_as<T, double> || std::same_as<T, std::int32_t> ||
    std::same_as<T, std::int64_t> || std::same_as<T, std::uint64_t>;

template <Number T>
constexpr Type type_of() {
    if constexpr (std::same_as<T, float>) return Type::float32;
    if constexpr (std::same_as<T, double>) return Type::float64;
    if constexpr (std::same_as<T, std::int32_t>) return Type::int32;
    if constexpr (std::same_as<T, std::int64_t>) return Type::int64;
    if constexpr (std::same_as<T, std::uint64_t>) return Type::uint64;
}

/// Bytes of one number.
constexpr std::size_t size_of(Type type) noexcept {
    return type == Type::float32 || type == Type::int32 ? sizeof(float) : sizeof(double);
}

/// NumPy's name of the type: "float32".
constexpr std::string_view name(Type type) noexcept {
    constexpr std::string_view names[] = {"float32", "float64", "int32", "int64", "uint64"};
    return names[static_cast<int>(type)];
}

/// "10 x 3"; `any` prints as "n", a shape without dimensions as "scalar".
inline std::string text(const Shape& shape) {
    if (shape.empty()) return "scalar";
    std::string result;
    for (const std::size_t d : shape)
        result.append(result.empty() ? "" : " x ").append(d == any ? "n" : std::to_string(d));
    return result;
}

/// Source of a virtual dataset: a whole dataset of the same type and shape in another file. The file name is
/// relative to the folder of the referring file.
struct VirtualSource {
    std::string file, dataset;
};

/// Product of the dimensions.
inline std::size_t element_count(const Shape& shape) noexcept {
    return std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
}

}  // namespace nbd::h5
