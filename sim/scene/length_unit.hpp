#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace nbd {

/// Units of length that a mesh file may be in, and their metres.
inline constexpr std::array<std::pair<const char*, double>, 6> length_units{
    {{"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}, {"in", 0.0254}, {"ft", 0.3048}}};

inline std::vector<std::string> length_unit_names() {
    std::vector<std::string> names;
    for (const auto& [name, metres] : length_units) names.emplace_back(name);
    return names;
}

/// Metres of one of length_units; 1 for any other text.
inline double metres_in(const std::string& unit) {
    for (const auto& [name, metres] : length_units)
        if (unit == name) return metres;
    return 1;
}

}  // namespace nbd
