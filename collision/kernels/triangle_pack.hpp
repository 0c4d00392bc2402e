#pragma once

#include "collision/kernels/kernels.hpp"
#include "collision/kernels/packs.hpp"

namespace nbd {

/// Sets bit k if the plane of one of the triangles s[k] and t[k] certainly has the other strictly on one
/// side; they then have no point in common.
inline unsigned separated_by_plane(const TrianglePack& s, const TrianglePack& t) noexcept {
    return kernels().separated_by_plane(s, t);
}

/// Whether an edge of one triangle meets the other triangle. If two triangles have a point in common, some
/// edge does.
inline PackVerdict edges_meet_faces(const TrianglePack& s, const TrianglePack& t) noexcept {
    return kernels().edges_meet_faces(s, t);
}

}  // namespace nbd
