#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace nbd {

/// How far grips and obstacles have come on the ways that they are given in a part of a step: shares, 1 at
/// the end.
struct GivenWays {
    double obstacles = 1, grips = 1;

    explicit GivenWays(bool is_any) noexcept : obstacles(is_any ? 0 : 1), grips(obstacles) {}

    bool are_gone() const noexcept { return obstacles == 1 && grips == 1; }

    /// After a share of a linearisation's motion, which was shortened to another share of what it led to.
    /// Obstacles go on as far as the motion does, grips are nodes of it.
    void go(double share, double trusted) noexcept {
        const auto after = [](double gone, double more) { return more == 1 ? 1 : gone + more * (1 - gone); };
        obstacles = after(obstacles, share);
        grips = after(grips, share * trusted);
    }

    /// Why a part that ends before they are gone is none.
    std::string text() const {
        return fmt::format("grips and obstacles cannot go {:.2g} of their way without an intersection",
                           1 - std::min(obstacles, grips));
    }
};

}  // namespace nbd
