#pragma once

#include "collision/kernels/kernels.hpp"
#include "collision/kernels/packs.hpp"

namespace nbd {

/// Bit k is set where the plane of one of the triangles s[k] and t[k] has the other one certainly on one
/// side, strictly: then they have no point in common.
inline unsigned separated_by_plane(const TrianglePack& s, const TrianglePack& t) noexcept {
    return kernels().separated_by_plane(s, t);
}

/// Whether an edge of one triangle meets the other triangle, which is so if they have a point in common at
/// all.
inline PackVerdict edges_meet_faces(const TrianglePack& s, const TrianglePack& t) noexcept {
    return kernels().edges_meet_faces(s, t);
}

}  // namespace nbd
