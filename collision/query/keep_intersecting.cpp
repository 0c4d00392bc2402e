#include "collision/query/keep_intersecting.hpp"

#include <algorithm>
#include <span>

#include "collision/geometry/triangle_triangle.hpp"
#include "collision/kernels/lane_mask.hpp"
#include "collision/kernels/triangle_pack.hpp"

namespace nbd {
namespace {

/// Packs up to 16 faces; the lanes left over repeat the last one.
template <int FacePair::*face, class Posed>
TrianglePack pack(const Posed& faces, std::span<const FacePair> pairs) noexcept {
    const float* corners[3][TrianglePack::lanes];
    Eigen::Array4f spare;
    for (std::size_t lane = 0; lane < TrianglePack::lanes; ++lane) {
        const FaceCorners places = faces.corners(pairs[std::min(lane, pairs.size() - 1)].*face, spare);
        for (std::size_t k = 0; k < 3; ++k) corners[k][lane] = places[k];
    }
    TrianglePack packed;
    kernels().pack_triangles(corners, packed);
    return packed;
}

/// Filters pairs, up to 16 at a time: `keep` returns a bit for each of them; further bits are ignored.
template <class Posed, class Keep>
void filter(std::vector<FacePair>& pairs, const Posed& a, const Posed& b, const Keep& keep) {
    std::size_t kept = 0;
    for (std::size_t first = 0; first < pairs.size(); first += TrianglePack::lanes) {
        const auto count = std::min<std::size_t>(TrianglePack::lanes, pairs.size() - first);
        const auto some = std::span<const FacePair>(pairs).subspan(first, count);
        const unsigned mask = keep(some, pack<&FacePair::a>(a, some), pack<&FacePair::b>(b, some));
        for_each_bit(mask & ((1u << count) - 1), [&](int k) { pairs[kept++] = some[k]; });
    }
    pairs.resize(kept);
}

template <class Posed>
void keep(std::vector<FacePair>& pairs, const Posed& a, const Posed& b) noexcept {
    using Some = std::span<const FacePair>;
    filter(pairs, a, b,
           [](Some, const TrianglePack& s, const TrianglePack& t) { return ~separated_by_plane(s, t); });
    filter(pairs, a, b, [&](Some some, const TrianglePack& s, const TrianglePack& t) {
        auto [meeting, apart] = edges_meet_faces(s, t);
        for (std::size_t k = 0; k < some.size(); ++k)
            if (((meeting | apart) >> k & 1) == 0 &&
                triangles_intersect(a.triangle(some[k].a), b.triangle(some[k].b)))
                meeting |= 1u << k;
        return meeting;
    });
}

}  // namespace

void keep_intersecting(std::vector<FacePair>& pairs, const PosedFaces& a, const PosedFaces& b) noexcept {
    keep(pairs, a, b);
}

void keep_intersecting(std::vector<FacePair>& pairs, const AffineBoxes& a, const AffineBoxes& b) noexcept {
    keep(pairs, a, b);
}

}  // namespace nbd
