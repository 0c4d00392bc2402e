#include "collision/query/narrow_phase.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "collision/geometry/closest_points.hpp"
#include "collision/geometry/triangle_triangle.hpp"
#include "collision/kernels/box_pack.hpp"

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
    filter(pairs, a, b, [](Some, const TrianglePack& s, const TrianglePack& t) {
        return ~kernels().separated_by_plane(s, t);
    });
    filter(pairs, a, b, [&](Some some, const TrianglePack& s, const TrianglePack& t) {
        auto [meeting, apart] = kernels().edges_meet_faces(s, t);
        for (std::size_t k = 0; k < some.size(); ++k)
            if (((meeting | apart) >> k & 1) == 0 &&
                triangles_intersect(a.triangle(some[k].a), b.triangle(some[k].b)))
                meeting |= 1u << k;
        return meeting;
    });
}

/// Whether two triangles are within `distance`, if their corners, the balls around them or a plane between
/// them tell.
std::optional<bool> surely_within(const Triangle& a, const Triangle& b, double distance) noexcept {
    constexpr double rounding = 1e-12;  // more than that of all steps below and of triangle_distance()
    const auto corners = [](const Triangle& t) {
        return std::array<Eigen::Vector3d, 3>{t.a.cast<double>(), t.b.cast<double>(), t.c.cast<double>()};
    };
    const auto in_a = corners(a), in_b = corners(b);
    double least = (in_a[0] - in_b[0]).squaredNorm();
    for (const auto& p : in_a)
        for (const auto& q : in_b) least = std::min(least, (p - q).squaredNorm());
    if (least <= distance * distance * (1 - rounding)) return true;
    const Eigen::Vector3d centre_a = (in_a[0] + in_a[1] + in_a[2]) / 3,
                          centre_b = (in_b[0] + in_b[1] + in_b[2]) / 3;
    double radius_a = 0, radius_b = 0, size = 0;
    for (const auto& p : in_a) radius_a = std::max(radius_a, (p - centre_a).squaredNorm());
    for (const auto& p : in_b) radius_b = std::max(radius_b, (p - centre_b).squaredNorm());
    for (const auto* corners_of : {&in_a, &in_b})
        for (const auto& p : *corners_of) size = std::max(size, p.cwiseAbs().maxCoeff());
    const double most = distance + std::sqrt(radius_a) + std::sqrt(radius_b) + rounding * size;
    const Eigen::Vector3d along = centre_b - centre_a;
    if (along.squaredNorm() > most * most * (1 + rounding)) return false;
    // The triangles are at least as far apart as what they cover of a line.
    double end_a = along.dot(in_a[0]), begin_b = along.dot(in_b[0]);
    for (std::size_t k = 1; k < 3; ++k) {
        end_a = std::max(end_a, along.dot(in_a[k]));
        begin_b = std::min(begin_b, along.dot(in_b[k]));
    }
    if (begin_b - end_a > (distance + rounding * size) * along.norm() * (1 + rounding)) return false;
    return std::nullopt;
}

template <class Posed>
void keep_near(std::vector<FacePair>& pairs, const Posed& a, const Posed& b, double distance) noexcept {
    std::erase_if(pairs, [&](const FacePair& pair) {
        const Triangle s = a.triangle(pair.a), t = b.triangle(pair.b);
        const std::optional<bool> sure = surely_within(s, t, distance);
        return !(sure ? *sure : triangle_distance(s, t) <= distance);
    });
}

}  // namespace

void keep_intersecting(std::vector<FacePair>& pairs, const PosedFaces& a, const PosedFaces& b) noexcept {
    keep(pairs, a, b);
}

void keep_intersecting(std::vector<FacePair>& pairs, const PosedWideTree& a,
                       const PosedWideTree& b) noexcept {
    keep(pairs, a, b);
}

void keep_within(std::vector<FacePair>& pairs, const PosedFaces& a, const PosedFaces& b,
                 float distance) noexcept {
    keep_near(pairs, a, b, distance);
}

void keep_within(std::vector<FacePair>& pairs, const PosedWideTree& a, const PosedWideTree& b,
                 float distance) noexcept {
    keep_near(pairs, a, b, distance);
}

}  // namespace nbd
