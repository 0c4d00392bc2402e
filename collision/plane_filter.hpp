#pragma once

#include <array>

#include "collision/geometry.hpp"

namespace nbd {

/// Sixteen triangles, a lane each.
struct TrianglePack {
    static constexpr int lanes = 16;
    using Lanes = Eigen::Array<float, lanes, 1>;
    struct Corner {
        Lanes x, y, z;
    };
    std::array<Corner, 3> corners;
};

/// Bit k is set unless the plane of one of the triangles s[k] and t[k] has the other one certainly on one
/// side, strictly: then they have no point in common.
unsigned may_intersect(const TrianglePack& s, const TrianglePack& t) noexcept;

}  // namespace nbd
