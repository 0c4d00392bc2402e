#include "sim/contact/self_contact.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

#include "collision/base/stopwatch.hpp"
#include "meshing/parallel/parallel_for.hpp"
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

void in_parallel(int count, const std::function<void(int)>& task) { parallel_for(count, task, 1); }

}  // namespace

double self_thickness(const ContactShape& shape, double thickness) {
    // Twice the area of a face is about the square of its edges' length.
    const double area =
        shape.rest_areas.sum() / static_cast<double>(std::max<Eigen::Index>(shape.F.rows(), 1));
    return std::min(thickness, std::sqrt(2 * area));
}

SelfContactRest::SelfContactRest(const ContactSurface& surface, NodesRef rest, const WideTree* tree,
                                 double thickness)
    : shape_(surface.shape()), tree_(tree), thickness_(thickness) {
    const Nodes X = embedded(surface.W(), Nodes(rest));
    near_ = near_at_rest(X.cast<float>(), surface.F(), static_cast<float>(2 * thickness));
    if (!surface.has_patches_of(tree)) return;
    // Faces whose boxes are within the reach of contact are seldom farther apart than this.
    const double edge = self_thickness(*shape_, std::numeric_limits<double>::infinity()),
                 radius = 3 * thickness + edge;
    // The pairs that are near were found with positions in single precision.
    const double rounding = 4 * 0x1p-24 * X.cwiseAbs().maxCoeff();
    neighbours_ = std::make_shared<const RestNeighbours>(
        X, surface.F(), *tree, near_, std::max(2 * thickness - rounding, 0.0), radius, in_parallel);
}

SelfContactFinder::SelfContactFinder(int body, std::shared_ptr<const SelfContactRest> rest)
    : body_(body), rest_(std::move(rest)), query_(rest_->near()) {
    if (rest_->neighbours()) proof_.emplace(rest_->neighbours());
}

void SelfContactFinder::find(const ContactSurface& surface, PosedTree& tree, const Nodes& v, double dt,
                             double error, double moved, VertexSides& sides, std::vector<Contact>& contacts) {
    const double thickness = rest_->thickness();
    const Eigen::RowVector3d frame = v.colwise().mean();
    const double fastest_node = (v.rowwise() - frame).rowwise().norm().maxCoeff();
    const ContactReach reach{.apart = thickness,
                             .inside = std::max(thickness, std::min(deepest(sides), 2 * thickness)),
                             .approach = std::min(2 * dt * fastest_node, thickness)};
    motions_ = dt * embedded(surface.W(), v);
    const Nodes& x = surface.positions();  // all of them, before threads read them
    costs_ = {};
    const auto pairs = timed(costs_.collision_us, [&] {
        if (proof_) prove(x, reach);
        return near_faces(tree, reach, error);
    });
    costs_.face_pairs = std::ssize(pairs);
    costs_.nodes_bounded = query_.counters().nodes_bounded;
    costs_.nodes_out_of_range = query_.counters().nodes_out_of_range;
    measure_faces(surface, pairs);
    constexpr int pairs_per_task = 1024;
    const Test test{reach, moved, sides};
    std::vector<Found> found((pairs.size() + pairs_per_task - 1) / pairs_per_task);
    in_parallel(found.size(), [&](int task) {
        const auto first = static_cast<std::size_t>(task) * pairs_per_task;
        for (std::size_t k = first; k < std::min(first + pairs_per_task, pairs.size()); ++k)
            test_pair(surface, pairs[k], test, found[task]);
    });
    Found all;
    for (const Found& part : found) {
        all.vertices.insert(all.vertices.end(), part.vertices.begin(), part.vertices.end());
        all.edges.insert(all.edges.end(), part.edges.begin(), part.edges.end());
    }
    add_vertices(surface, all.vertices, sides, contacts);
    std::ranges::sort(all.edges, {}, [](const EdgeContact& e) { return std::pair(e.a, e.b); });
    for (const EdgeContact& edges : all.edges) contacts.push_back(edges.contact);
}

void SelfContactFinder::prove(const Nodes& x, const ContactReach& reach) {
    const Stopwatch watch;
    proof_->prove(x, motions_, {.apart = reach.apart, .approach = reach.approach, .inside = reach.inside},
                  in_parallel);
    costs_.proof_us = watch.microseconds();
    costs_.patches = proof_->leaves();
    costs_.patches_proved = proof_->proved();
}

/// All pairs of faces in reach, and more: those of patches as far as these move relative to each other.
std::span<const FacePair> SelfContactFinder::near_faces(PosedTree& tree, const ContactReach& reach,
                                                        double error) {
    const auto most = static_cast<float>(reach.most() + error);
    query_.use(proof_ ? &*proof_ : nullptr);
    if (!proof_) return query_.boxes_within(tree, most);
    const auto reach_of = [&](int a, int b) {
        return std::min(most, static_cast<float>(reach.least() + proof_->relative_motion(a, b) + error));
    };
    // A copy of what it captures would be allocated.
    const LeafReach by_reference = std::cref(reach_of);
    return query_.boxes_within(tree, most, &by_reference);
}

void SelfContactFinder::measure_faces(const ContactSurface& surface, std::span<const FacePair> pairs) {
    const std::size_t faces = surface.F().rows();
    balls_.resize(faces);
    is_measured_.assign(faces, 0);
    std::vector<int> measured;
    for (const FacePair& pair : pairs)
        for (const int face : {pair.a, pair.b})
            if (std::exchange(is_measured_[face], 1) == 0) measured.push_back(face);
    parallel_for(measured.size(), [&](int i) {
        const int face = measured[i];
        const auto corners = surface.F().row(face);
        FaceBalls& balls = balls_[face];
        balls = {
            .centre = (surface.x(corners[0]) + surface.x(corners[1]) + surface.x(corners[2])) / 3,
            .motion = (motions_.row(corners[0]) + motions_.row(corners[1]) + motions_.row(corners[2])) / 3,
            .radius = 0,
            .spread = 0};
        for (const int corner : corners) {
            balls.radius = std::max(balls.radius, (surface.x(corner) - balls.centre).norm());
            balls.spread = std::max(balls.spread, (motions_.row(corner).transpose() - balls.motion).norm());
        }
    });
}

/// Tests the features that two faces own, each with those of the other.
void SelfContactFinder::test_pair(const ContactSurface& surface, const FacePair& pair, const Test& test,
                                  Found& found) const {
    const ContactReach& reach = test.reach;
    const FaceBalls &a = balls_[pair.a], &b = balls_[pair.b];
    const double motion = (a.motion - b.motion).norm() + a.spread + b.spread,
                 most = std::min(reach.most(), reach.least() + motion) + a.radius + b.radius;
    if ((a.centre - b.centre).squaredNorm() > most * most) return;
    const SurfaceTopology& topology = surface.topology();
    for (const auto& [own, other] : {std::pair(pair.a, pair.b), std::pair(pair.b, pair.a)})
        for (const int vertex : surface.F().row(own))
            if (topology.owner_of_vertex(vertex) == own) test_vertex(surface, vertex, other, test, found);
    for (const int e : topology.face_edges.row(pair.a)) {
        if (topology.owner_of_edge(e) != pair.a) continue;
        for (const int f : topology.face_edges.row(pair.b))
            if (topology.owner_of_edge(f) == pair.b)
                test_edges(surface, std::min(e, f), std::max(e, f), reach, found);
    }
}

void SelfContactFinder::test_vertex(const ContactSurface& surface, int vertex, int face, const Test& test,
                                    Found& found) const {
    const ContactReach& reach = test.reach;
    const Eigen::Vector3d p = surface.x(vertex);
    const FaceBalls& ball = balls_[face];
    const double most = reach.most() + ball.radius;
    if ((p - ball.centre).squaredNorm() > most * most) return;
    const ClosestPoints closest = closest_point(surface, face, p);
    if (closest.distance > reach.most()) return;
    const NearestFace candidate = measure(surface, face, closest, reach.most());
    const double distance = std::abs(candidate.distance);
    if (candidate.distance < 0) {
        const auto side = std::ranges::lower_bound(test.sides, vertex, {}, &VertexSide::vertex);
        if (side == test.sides.end() || side->vertex != vertex || candidate.normal.dot(side->normal) <= 0 ||
            distance > reach.inside || distance > side->depth + test.moved)
            return;
    } else if (distance > reach.apart) {
        const double motion = relative_motion(motions_, std::array{vertex}, surface.F().row(face));
        if (distance > reach.apart + std::min(reach.approach, motion)) return;
    }
    found.vertices.push_back({vertex, candidate});
}

void SelfContactFinder::test_edges(const ContactSurface& surface, int a, int b, const ContactReach& reach,
                                   Found& found) const {
    const auto& edges = surface.topology().edges;
    const double motion = std::min(reach.approach, relative_motion(motions_, edges.row(a), edges.row(b)));
    const std::optional<Contact> contact =
        edge_contact({body_, surface, a}, {body_, surface, b}, reach, motion);
    if (contact && contact->gap >= 0 && surface.edge_normal(a).dot(contact->normal) < -facing &&
        surface.edge_normal(b).dot(contact->normal) > facing)
        found.edges.push_back({a, b, *contact});
}

/// Appends the contacts of vertices with their nearest faces.
void SelfContactFinder::add_vertices(const ContactSurface& surface, std::vector<VertexFace>& vertices,
                                     VertexSides& sides, std::vector<Contact>& contacts) const {
    std::ranges::sort(vertices, {}, [](const VertexFace& v) {
        return std::tuple(v.vertex, std::abs(v.face.distance), v.face.face);
    });
    sides.clear();
    int last = -1;
    for (const auto& [vertex, nearest] : vertices) {
        if (std::exchange(last, vertex) == vertex) continue;
        if (nearest.distance >= 0 &&
            (vertex_normal(surface, vertex).dot(nearest.normal) > -facing ||
             surface.feature_normal(nearest.face, nearest.barycentric).dot(nearest.normal) < facing))
            continue;
        const auto corners = surface.F().row(nearest.face);
        const Eigen::Vector3d& w = nearest.barycentric;
        sides.push_back({vertex, nearest.normal, std::max(0.0, -nearest.distance)});
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

}  // namespace nbd
