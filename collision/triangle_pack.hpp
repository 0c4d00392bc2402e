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

/// Bit k is set where the plane of one of the triangles s[k] and t[k] has the other one certainly on one
/// side, strictly: then they have no point in common.
unsigned separated_by_plane(const TrianglePack& s, const TrianglePack& t) noexcept;

/// What is certain, in exact arithmetic, of the triangles in each lane of two packs. A lane that is in
/// neither is too close to call in float32.
struct PackVerdict {
    unsigned meeting = 0, apart = 0;  // bit k: s[k] and t[k] have a point in common, or none
};

/// Whether an edge of one triangle meets the other triangle, which is so if they have a point in common at
/// all.
PackVerdict edges_meet_faces(const TrianglePack& s, const TrianglePack& t) noexcept;

}  // namespace nbd
