#include "sim/contact/self_contact.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "sim/contact/edge_contact.hpp"
#include "sim/contact/nearest_face.hpp"

namespace nbd {
namespace {

/// Surfaces press on each other where the cosines between their outward normals and the line between their
/// closest points are above this. Others are parts of one sheared surface, or of a thin part and what it lies
/// on.
constexpr double facing = 0.25;

Eigen::Vector3d vertex_normal(const ContactSurface& surface, int vertex) {
    const int face = surface.topology().owner_of_vertex(vertex);
    Eigen::Vector3d corner = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) corner[k] = surface.F()(face, k) == vertex;
    return surface.feature_normal(face, corner);
}

/// Largest motion of one of some vertices relative to one of others. motions: of all vertices, [n, 3].
template <class VerticesA, class VerticesB>
double relative_motion(const Nodes& motions, const VerticesA& a, const VerticesB& b) {
    double squared = 0;
    for (const int i : a)
        for (const int j : b) squared = std::max(squared, (motions.row(i) - motions.row(j)).squaredNorm());
    return std::sqrt(squared);
}

/// A ball that holds a face.
struct FaceBall {
    FaceBall(const ContactSurface& surface, int face) {
        const auto corners = surface.F().row(face);
        centre = (surface.x(corners[0]) + surface.x(corners[1]) + surface.x(corners[2])) / 3;
        for (const int corner : corners) radius = std::max(radius, (surface.x(corner) - centre).norm());
    }
    Eigen::Vector3d centre;
    double radius = 0;
};

}  // namespace

double self_thickness(const ContactShape& shape, double thickness) {
    // Twice the area of a face is about the square of its edges' length.
    const double area =
        shape.rest_areas.sum() / static_cast<double>(std::max<Eigen::Index>(shape.F.rows(), 1));
    return std::min(thickness, std::sqrt(2 * area));
}

void SelfContactFinder::find(const ContactSurface& surface, NodesRef rest, PosedTree& tree, const Nodes& v,
                             double dt, double thickness, double error, double moved,
                             std::vector<Contact>& contacts) {
    if (std::exchange(near_at_rest_, 2 * thickness) != 2 * thickness)
        query_ = SelfQuery(near_at_rest(embedded(surface.W(), Nodes(rest)).cast<float>(), surface.F(),
                                        static_cast<float>(2 * thickness)));
    const Eigen::RowVector3d frame = v.colwise().mean();
    const double fastest_node = (v.rowwise() - frame).rowwise().norm().maxCoeff();
    const ContactReach reach{.apart = thickness,
                             .inside = std::max(thickness, std::min(deepest(sides_), 2 * thickness)),
                             .approach = std::min(2 * dt * fastest_node, thickness)};
    const auto pairs = query_.boxes_within(tree, static_cast<float>(reach.most() + error));
    face_pairs_ = static_cast<long>(pairs.size());
    if (!pairs.empty()) motions_ = dt * embedded(surface.W(), v);
    collect(surface, pairs, reach);
    find_vertices(surface, reach, moved, contacts);
    find_edges(surface, reach, contacts);
}

/// The features that two faces own, each with those of the other.
void SelfContactFinder::collect(const ContactSurface& surface, std::span<const FacePair> pairs,
                                const ContactReach& reach) {
    vertex_faces_.clear();
    edge_pairs_.clear();
    const SurfaceTopology& topology = surface.topology();
    for (const FacePair& faces : pairs) {
        const FaceBall a(surface, faces.a), b(surface, faces.b);
        const double apart = (a.centre - b.centre).norm() - a.radius - b.radius;
        if (apart > reach.most()) continue;
        const auto in_a = surface.F().row(faces.a), in_b = surface.F().row(faces.b);
        if (apart > reach.least() + relative_motion(motions_, in_a, in_b)) continue;
        for (const auto& [own, other] : {std::pair(faces.a, faces.b), std::pair(faces.b, faces.a)})
            for (const int vertex : surface.F().row(own))
                if (topology.owner_of_vertex(vertex) == own) vertex_faces_.push_back({vertex, other});
        for (const int e : topology.face_edges.row(faces.a)) {
            if (topology.owner_of_edge(e) != faces.a) continue;
            for (const int f : topology.face_edges.row(faces.b))
                if (topology.owner_of_edge(f) == faces.b)
                    edge_pairs_.push_back({std::min(e, f), std::max(e, f)});
        }
    }
    std::ranges::sort(vertex_faces_);
    std::ranges::sort(edge_pairs_);
}

void SelfContactFinder::find_vertices(const ContactSurface& surface, const ContactReach& reach, double moved,
                                      std::vector<Contact>& contacts) {
    const VertexSides known = std::exchange(sides_, {});
    for (std::size_t begin = 0, end = 0; begin < vertex_faces_.size(); begin = end) {
        const int vertex = vertex_faces_[begin].a;
        const auto side = std::ranges::lower_bound(known, vertex, {}, &VertexSide::vertex);
        const bool touched = side != known.end() && side->vertex == vertex;
        const Eigen::Vector3d p = surface.x(vertex);
        NearestFace nearest;
        for (; end < vertex_faces_.size() && vertex_faces_[end].a == vertex; ++end) {
            const int face = vertex_faces_[end].b;
            const NearestFace candidate = measure(surface, face, p, reach.most());
            const double distance = std::abs(candidate.distance);
            if (!(distance < std::abs(nearest.distance)) || distance > reach.most()) continue;
            if (candidate.distance < 0) {
                if (!touched || candidate.normal.dot(side->normal) <= 0 || distance > reach.inside ||
                    distance > side->depth + moved)
                    continue;
            } else if (distance > reach.apart) {
                const double motion = relative_motion(motions_, std::array{vertex}, surface.F().row(face));
                if (distance > reach.apart + std::min(reach.approach, motion)) continue;
            }
            nearest = candidate;
        }
        if (nearest.face < 0) continue;
        if (nearest.distance >= 0 &&
            (vertex_normal(surface, vertex).dot(nearest.normal) > -facing ||
             surface.feature_normal(nearest.face, nearest.barycentric).dot(nearest.normal) < facing))
            continue;
        const auto corners = surface.F().row(nearest.face);
        const Eigen::Vector3d& w = nearest.barycentric;
        sides_.push_back({vertex, nearest.normal, std::max(0.0, -nearest.distance)});
        contacts.push_back({.a = {.body = body_, .count = 1, .vertices = {vertex}, .weights = {1}},
                            .b = {.body = body_,
                                  .count = 3,
                                  .vertices = {corners[0], corners[1], corners[2]},
                                  .weights = {w[0], w[1], w[2]}},
                            .normal = nearest.normal,
                            .gap = nearest.distance,
                            .area = surface.rest_areas()[vertex]});
    }
}

void SelfContactFinder::find_edges(const ContactSurface& surface, const ContactReach& reach,
                                   std::vector<Contact>& contacts) {
    const auto& edges = surface.topology().edges;
    for (const auto& [e, f] : edge_pairs_) {
        const EdgeOfBody a{body_, surface, e}, b{body_, surface, f};
        const double motion = std::min(reach.approach, relative_motion(motions_, edges.row(e), edges.row(f)));
        const std::optional<Contact> contact = edge_contact(a, b, reach, motion);
        if (contact && contact->gap >= 0 && surface.edge_normal(e).dot(contact->normal) < -facing &&
            surface.edge_normal(f).dot(contact->normal) > facing)
            contacts.push_back(*contact);
    }
}

void SelfContactFinder::save_sides(ContactSides& sides) const { append(sides_, body_, body_, sides); }

void SelfContactFinder::restore_sides(const ContactSides& sides) { sides_ = sides_of(sides, body_, body_); }

}  // namespace nbd
