#pragma once

#include <fmt/core.h>

#include <concepts>
#include <string>
#include <string_view>

namespace nbd {

/// A number with its noun: "1 trajectory", "2 trajectories".
std::string counted(std::integral auto n, std::string_view one, std::string_view many) {
    return fmt::format("{} {}", n, n == 1 ? one : many);
}

/// The same for nouns whose plural ends in s.
std::string counted(std::integral auto n, std::string_view one) {
    return counted(n, one, std::string(one) + "s");
}

/// "1 trajectory", "2 trajectories".
std::string counted_trajectories(std::integral auto n) { return counted(n, "trajectory", "trajectories"); }

}  // namespace nbd
