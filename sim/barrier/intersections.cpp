#include "sim/barrier/intersections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "collision/geometry/triangle_triangle.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "sim/barrier/face_distance.hpp"

namespace nbd {
namespace {

std::array<int, 3> face(const MovingSurface& surface, int f) {
    return {surface.F()(f, 0), surface.F()(f, 1), surface.F()(f, 2)};
}

Intersection within(int surface, FacePair faces) {
    return {surface, surface, std::min(faces.a, faces.b), std::max(faces.a, faces.b)};
}

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

/// A face and all that have a common vertex with it, each once.
std::vector<int> faces_about(const MovingSurface& surface, int face) {
    const SurfaceTopology& topology = surface.topology();
    std::vector<int> faces{face};
    for (int k = 0; k < 3; ++k) {
        const std::size_t v = surface.F()(face, k);
        faces.insert(faces.end(), topology.vertex_faces.begin() + topology.vertex_begin[v],
                     topology.vertex_faces.begin() + topology.vertex_begin[v + 1]);
    }
    std::ranges::sort(faces);
    faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
    return faces;
}

}  // namespace

void IntersectionSearch::begin(const std::vector<MovingSurface>& surfaces, double distance,
                               const PairRules& rules) {
    rules_ = rules;
    neighbours_.clear();
    at_rest_.clear();
    touching_.clear();
    for (int s = 0; s < std::ssize(surfaces); ++s) {
        if (!rules_.meet(surfaces[s].body(), surfaces[s].body())) continue;
        if (!surfaces[s].proof()) add_neighbours(surfaces[s], s, neighbours_);
        find_at_rest(surfaces, s, distance);
    }
    about_rest_.clear();
    for (const Intersection& i : touching_) {
        const MovingSurface& s = surfaces[i.surface_a];
        for (const int a : faces_about(s, i.a))
            for (const int b : faces_about(s, i.b))
                if (a != b) about_rest_.push_back({i.surface_a, i.surface_a, std::min(a, b), std::max(a, b)});
    }
    std::ranges::sort(about_rest_);
    about_rest_.erase(std::unique(about_rest_.begin(), about_rest_.end()), about_rest_.end());
}

/// By a look at the whole surface: a HostProof takes it that there are none.
void IntersectionSearch::find_at_rest(const std::vector<MovingSurface>& surfaces, int surface,
                                      double distance) {
    const MovingSurface& s = surfaces[surface];
    const auto twin = std::find_if(surfaces.begin(), surfaces.begin() + surface, [&](const MovingSurface& t) {
        return &t.shape() == &s.shape() && rules_.meet(t.body(), t.body());
    });
    if (const int number = static_cast<int>(twin - surfaces.begin()); number < surface) {
        for (std::vector<Intersection>* list : {&at_rest_, &touching_}) {
            std::vector<Intersection> same;
            for (const Intersection& i : *list)
                if (i.surface_a == number) same.push_back({surface, surface, i.a, i.b});
            list->insert(list->end(), same.begin(), same.end());
        }
        return;
    }
    std::vector<MovingSurface> resting;
    resting.emplace_back(MovingSurface(s, s.body()));
    candidates_.clear();
    add_neighbours(resting[0], 0, candidates_);
    const std::size_t neighbours = candidates_.size();
    const auto near = static_cast<float>(distance + 2 * resting[0].rounding());
    for (const FacePair& faces : self_query_.boxes_within(resting[0].still_tree(), near))
        candidates_.push_back(within(0, faces));
    const std::vector<Intersection> found = keep_intersecting(resting);
    for (const Intersection& i : found) at_rest_.push_back({surface, surface, i.a, i.b});
    touching_.insert(touching_.end(), at_rest_.end() - found.size(), at_rest_.end());
    std::vector<char> touch(candidates_.size() - neighbours);
    parallel_for(touch.size(), [&](int k) {
        const Intersection& i = candidates_[neighbours + k];
        touch[k] = face_distance(face(s, i.a), face(s, i.b),
                                 [&](int v) { return Eigen::Vector3d(s.rest().row(v)); }) < distance;
    });
    for (std::size_t k = 0; k < touch.size(); ++k)
        if (const Intersection& i = candidates_[neighbours + k]; touch[k])
            touching_.push_back({surface, surface, i.a, i.b});
}

void IntersectionSearch::leave_out(std::vector<Intersection> faces) {
    left_out_ = std::move(faces);
    std::ranges::sort(left_out_);
}

std::vector<Intersection> IntersectionSearch::find(std::vector<MovingSurface>& surfaces) {
    candidates_ = neighbours_;
    const auto add = [&](int a, int b, std::span<const FacePair> pairs) {
        surfaces[a].place_corners(pairs, &FacePair::a);
        surfaces[b].place_corners(pairs, &FacePair::b);
        for (const FacePair& faces : pairs)
            candidates_.push_back(a == b ? within(a, faces) : Intersection{a, b, faces.a, faces.b});
    };
    const int count = surfaces.size();
    for (int a = 0; a < count; ++a) {
        MovingSurface& s = surfaces[a];
        if (rules_.meet(s.body(), s.body())) {
            add(a, a, open_pairs(s, static_cast<float>(2 * s.rounding())));
            if (s.proof()) add(a, a, s.proof()->open_faces());
        }
        for (int b = a + 1; b < count; ++b) {
            MovingSurface& t = surfaces[b];
            if (!rules_.meet(s.body(), t.body())) continue;
            const auto distance = static_cast<float>(s.rounding() + t.rounding());
            add(a, b, pair_query_.boxes_within(s.still_tree(), t.still_tree(), distance));
        }
    }
    std::vector<Intersection> found = keep_intersecting(surfaces);
    std::erase_if(found, [&](const Intersection& i) {
        return std::ranges::binary_search(about_rest_, i) || std::ranges::binary_search(left_out_, i);
    });
    return found;
}

bool IntersectionSearch::missed_within(std::vector<MovingSurface>& surfaces, double distance) {
    for (std::size_t a = 0; a < surfaces.size(); ++a)
        for (std::size_t b = a + 1; b < surfaces.size(); ++b) {
            MovingSurface &s = surfaces[a], &t = surfaces[b];
            if ((!s.can_miss() && !t.can_miss()) || !rules_.meet(s.body(), t.body())) continue;
            const int first_of_t = s.rest().rows();  // in numbers of the vertices of both
            const auto at = [&](int v) {
                return Eigen::Vector3d(v < first_of_t ? s.end(v) : t.end(v - first_of_t));
            };
            const auto near = static_cast<float>(distance + s.rounding() + t.rounding());
            for (const FacePair& faces : pair_query_.boxes_within(s.still_tree(), t.still_tree(), near)) {
                const Intersection pair{static_cast<int>(a), static_cast<int>(b), faces.a, faces.b};
                if (std::ranges::binary_search(left_out_, pair)) continue;
                std::array<int, 3> other = face(t, faces.b);
                for (int& v : other) v += first_of_t;
                if (face_distance(face(s, faces.a), other, at) <= distance) return true;
            }
        }
    return false;
}

std::span<const FacePair> IntersectionSearch::open_pairs(MovingSurface& surface, float distance) {
    const std::optional<HostProof>& proof = surface.proof();
    if (!proof) return self_query_.boxes_within(surface.still_tree(), distance);
    return self_query_.boxes_within(surface.still_tree(), distance, proof->known_leaves(),
                                    proof->open_leaves());
}

/// Of the candidates.
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
