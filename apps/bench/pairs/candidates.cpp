#include "apps/bench/pairs/candidates.hpp"

#include <algorithm>

#include "collision/plane_filter.hpp"
#include "collision/triangle_triangle.hpp"

namespace nbd {
namespace {

/// Sixteen faces, a lane each.
template <int FacePair::*face>
TrianglePack pack(const PosedFaces& faces, std::span<const FacePair> pairs) noexcept {
    TrianglePack packed;
    for (int lane = 0; lane < TrianglePack::lanes; ++lane) {
        const auto i = std::min(static_cast<std::size_t>(lane), pairs.size() - 1);
        for (int k = 0; k < 3; ++k) {
            const auto corner = faces.corner(pairs[i].*face, k);
            TrianglePack::Corner& lanes = packed.corners[static_cast<std::size_t>(k)];
            lanes.x[lane] = corner.x();
            lanes.y[lane] = corner.y();
            lanes.z[lane] = corner.z();
        }
    }
    return packed;
}

}  // namespace

void keep_intersecting(std::vector<FacePair>& candidates, const PosedFaces& a, const PosedFaces& b) {
    std::size_t kept = 0;
    for (std::size_t first = 0; first < candidates.size(); first += TrianglePack::lanes) {
        const auto count = std::min<std::size_t>(TrianglePack::lanes, candidates.size() - first);
        const auto pairs = std::span<const FacePair>(candidates).subspan(first, count);
        const unsigned mask = may_intersect(pack<&FacePair::a>(a, pairs), pack<&FacePair::b>(b, pairs));
        for (std::size_t k = 0; k < count; ++k) {
            const FacePair pair = pairs[k];
            if ((mask >> k & 1) != 0 && triangles_intersect(a.face(pair.a), b.face(pair.b)))
                candidates[kept++] = pair;
        }
    }
    candidates.resize(kept);
}

std::span<const FacePair> sorted_intersecting(std::vector<FacePair>& candidates, const PosedFaces& a,
                                              const PosedFaces& b) {
    keep_intersecting(candidates, a, b);
    std::ranges::sort(candidates);
    candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
    return candidates;
}

}  // namespace nbd
