#include "meshing/h5/types.hpp"

#include <fmt/format.h>

#include <functional>
#include <numeric>

namespace nbd::h5 {

std::size_t size_of(Type type) noexcept {
    return type == Type::float32 || type == Type::int32 ? sizeof(float) : sizeof(double);
}

std::string_view name(Type type) noexcept {
    switch (type) {
        case Type::float32:
            return "float32";
        case Type::float64:
            return "float64";
        case Type::int32:
            return "int32";
        case Type::int64:
            return "int64";
        case Type::uint64:
            return "uint64";
    }
    return "unknown";
}

std::string text(const Shape& shape) {
    if (shape.empty()) return "scalar";
    std::string result;
    for (const std::size_t d : shape)
        result += fmt::format("{}{}", result.empty() ? "" : " x ", d == any ? "n" : fmt::to_string(d));
    return result;
}

std::size_t element_count(const Shape& shape) noexcept {
    return std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
}

}  // namespace nbd::h5
