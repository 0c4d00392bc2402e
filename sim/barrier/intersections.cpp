#include "sim/barrier/intersections.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "collision/geometry/triangle_triangle.hpp"
#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

TriangleCorners face_corners(const MovingSurface& surface, int face) {
    return {surface.end(surface.F()(face, 0)), surface.end(surface.F()(face, 1)),
            surface.end(surface.F()(face, 2))};
}

/// Whether the side of face a opposite to its corner k meets face b.
bool side_meets(const MovingSurface& s, int a, int k, const TriangleCorners& b) {
    const TriangleCorners face = face_corners(s, a);
    const std::size_t p = (k + 1) % 3, q = (k + 2) % 3;
    return double_triangles_intersect({face[p], face[q], face[q]}, b);
}

/// Whether faces of one surface with common vertices have other points in common.
bool neighbours_intersect(const MovingSurface& s, int a, int b) {
    std::array<int, 3> common_a{}, common_b{};  // corners
    int count = 0;
    for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l)
            if (s.F()(a, k) == s.F()(b, l)) {
                common_a[count] = k;
                common_b[count] = l;
                ++count;
            }
    if (count == 1)
        return side_meets(s, a, common_a[0], face_corners(s, b)) ||
               side_meets(s, b, common_b[0], face_corners(s, a));
    if (count != 2) return true;
    const TriangleCorners corners_a = face_corners(s, a), corners_b = face_corners(s, b);
    const Eigen::Vector3d p = corners_a[3 - common_a[0] - common_a[1]],
                          q = corners_b[3 - common_b[0] - common_b[1]];
    const Eigen::Vector3d &u = corners_a[common_a[0]], &v = corners_a[common_a[1]];
    return double_triangles_intersect({p, p, p}, corners_b) ||
           double_triangles_intersect({q, q, q}, corners_a) ||
           double_triangles_intersect({u, p, p}, {v, q, q}) ||
           double_triangles_intersect({v, p, p}, {u, q, q});
}

bool have_common_vertex(const Faces& F, int a, int b) {
    for (int k = 0; k < 3; ++k)
        if ((F.row(b).array() == F(a, k)).any()) return true;
    return false;
}

/// Appends the faces of a surface with a common vertex, each pair once.
void add_neighbours(const MovingSurface& surface, int number, std::vector<Intersection>& neighbours) {
    const SurfaceTopology& topology = surface.topology();
    const auto first = std::ssize(neighbours);
    for (int a = 0; a < surface.F().rows(); ++a)
        for (int k = 0; k < 3; ++k) {
            const std::size_t v = surface.F()(a, k);
            for (int i = topology.vertex_begin[v]; i < topology.vertex_begin[v + 1]; ++i)
                if (const int b = topology.vertex_faces[i]; a < b)
                    neighbours.push_back({number, number, a, b});
        }
    std::sort(neighbours.begin() + first, neighbours.end());
    neighbours.erase(std::unique(neighbours.begin() + first, neighbours.end()), neighbours.end());
}

}  // namespace

void IntersectionSearch::begin(const std::vector<MovingSurface>& surfaces) {
    neighbours_.clear();
    for (int s = 0; s < std::ssize(surfaces); ++s)
        if (!surfaces[s].is_obstacle() && !surfaces[s].proof()) add_neighbours(surfaces[s], s, neighbours_);
}

std::vector<Intersection> IntersectionSearch::find_at_rest(std::vector<MovingSurface>& surfaces) {
    candidates_ = neighbours_;
    for (int s = 0; s < std::ssize(surfaces); ++s) {
        if (surfaces[s].is_obstacle()) continue;
        if (surfaces[s].proof()) add_neighbours(surfaces[s], s, candidates_);
        const auto distance = static_cast<float>(2 * surfaces[s].rounding());
        for (const FacePair& faces : self_query_.boxes_within(surfaces[s].tree(), distance))
            candidates_.push_back({s, s, faces.a, faces.b});
    }
    return keep_intersecting(surfaces);
}

std::vector<Intersection> IntersectionSearch::find(std::vector<MovingSurface>& surfaces) {
    candidates_ = neighbours_;
    const int count = surfaces.size();
    for (int a = 0; a < count; ++a) {
        MovingSurface& s = surfaces[a];
        if (!s.is_obstacle())
            for (const FacePair& faces : open_pairs(s, static_cast<float>(2 * s.rounding())))
                candidates_.push_back({a, a, faces.a, faces.b});
        if (s.proof())
            for (const FacePair& faces : s.proof()->open_faces())
                candidates_.push_back({a, a, faces.a, faces.b});
        for (int b = a + 1; b < count; ++b) {
            MovingSurface& t = surfaces[b];
            if (s.is_obstacle() && t.is_obstacle()) continue;
            const auto distance = static_cast<float>(s.rounding() + t.rounding());
            for (const FacePair& faces : pair_query_.boxes_within(s.tree(), t.tree(), distance))
                candidates_.push_back({a, b, faces.a, faces.b});
        }
    }
    return keep_intersecting(surfaces);
}

std::span<const FacePair> IntersectionSearch::open_pairs(MovingSurface& surface, float distance) {
    const std::optional<HostProof>& proof = surface.proof();
    if (!proof) return self_query_.boxes_within(surface.tree(), distance);
    return self_query_.boxes_within(surface.tree(), distance, proof->known_leaves(), proof->open_leaves());
}

std::vector<Intersection> IntersectionSearch::keep_intersecting(
    const std::vector<MovingSurface>& surfaces) const {
    std::vector<char> meets(candidates_.size());
    parallel_for(candidates_.size(), [&](int i) {
        const Intersection& pair = candidates_[i];
        const MovingSurface &s = surfaces[pair.surface_a], &t = surfaces[pair.surface_b];
        meets[i] = pair.surface_a == pair.surface_b && have_common_vertex(s.F(), pair.a, pair.b)
                       ? neighbours_intersect(s, pair.a, pair.b)
                       : double_triangles_intersect(face_corners(s, pair.a), face_corners(t, pair.b));
    });
    std::vector<Intersection> result;
    for (std::size_t i = 0; i < candidates_.size(); ++i)
        if (meets[i]) result.push_back(candidates_[i]);
    std::ranges::sort(result);
    return result;
}

std::string intersection_text(const std::vector<Intersection>& intersections,
                              const std::vector<MovingSurface>& surfaces) {
    constexpr std::size_t most = 3;
    const auto name = [&](int surface) {
        const MovingSurface& s = surfaces[surface];
        if (!s.is_obstacle()) return fmt::format("body {}", s.body());
        const auto meshes_before = std::count_if(surfaces.begin(), surfaces.begin() + surface,
                                                 [](const MovingSurface& t) { return t.is_obstacle(); });
        return fmt::format("obstacle mesh {}", meshes_before);
    };
    std::string text = fmt::format("{} face pairs intersect:", intersections.size());
    for (std::size_t i = 0; i < std::min(most, intersections.size()); ++i) {
        const Intersection& pair = intersections[i];
        text += fmt::format("{} face {} of {} and face {} of {}", i > 0 ? "," : "", pair.a,
                            name(pair.surface_a), pair.b, name(pair.surface_b));
    }
    return intersections.size() > most ? text + " ..." : text;
}

}  // namespace nbd
