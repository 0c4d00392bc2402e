#include "meshing/h5/types.hpp"

#include <fmt/format.h>

#include <functional>
#include <numeric>

namespace nbd::h5 {

std::size_t size_of(Type type) noexcept {
    return type == Type::float32 || type == Type::int32 ? sizeof(float) : sizeof(double);
}

std::string_view name(Type type) noexcept {
    static constexpr std::string_view names[] = {"float32", "float64", "int32", "int64", "uint64"};
    return names[static_cast<int>(type)];
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
