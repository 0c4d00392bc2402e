#include "sim/barrier/pair_weight.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/barrier/edge_mollifier.hpp"

namespace nbd {
namespace {

constexpr double most_lean = 0.3;   // sine of the angle at which the weight has vanished
constexpr double rounding = 1e-12;  // relative, of distances

/// How a line leads from a surface to a point that moves on.
class Lean {
 public:
    /// toward: unit. motion: of the point relative to the surface, metres.
    Lean(const Eigen::Vector3d& toward, const Eigen::Vector3d& motion) : toward_(toward), motion_(motion) {}

    /// Over the edges at a vertex.
    void add_vertex(const MovingSurface& surface, int vertex, double share);
    /// From inside of an edge over its faces.
    void add_edge(const MovingSurface& surface, int edge, double share);
    double weight(double most_rise) const {
        return std::max(0.0, 1 - most_ / most_lean) * std::max(0.0, 1 - rise_ / most_rise);
    }

 private:
    /// along: unit, along the surface.
    void add(const Eigen::Vector3d& along) {
        const double sine = std::max(toward_.dot(along), 0.0);
        most_ = std::max(most_, sine);
        rise_ = std::max(rise_, -sine * motion_.dot(along));
    }

    Eigen::Vector3d toward_, motion_;
    double most_ = 0;  // sine of the angle by which it leans over what is there
    double rise_ = 0;  // metres, by which the motion leads up the plane across the line
};

void Lean::add_vertex(const MovingSurface& surface, int vertex, double share) {
    const SurfaceTopology& topology = surface.topology();
    const Eigen::Vector3d from = surface.at(vertex, share);
    for (int i = topology.vertex_begin[vertex]; i < topology.vertex_begin[vertex + 1]; ++i)
        for (const int other : surface.F().row(topology.vertex_faces[i]))
            if (other != vertex) add((surface.at(other, share) - from).stableNormalized());
}

void Lean::add_edge(const MovingSurface& surface, int edge, double share) {
    const SurfaceTopology& topology = surface.topology();
    const auto ends = topology.edges.row(edge);
    const Eigen::Vector3d from = surface.at(ends[0], share),
                          along = (surface.at(ends[1], share) - from).stableNormalized();
    for (const int face : topology.edge_faces.row(edge)) {
        if (face < 0) continue;
        for (const int corner : surface.F().row(face)) {
            if (corner == ends[0] || corner == ends[1]) continue;
            Eigen::Vector3d into = surface.at(corner, share) - from;
            into -= into.dot(along) * along;
            add(into.stableNormalized());
        }
    }
}

/// What the ends of an edge, from u to w, leave to it of what presses a point: as much as Lean::weight()
/// takes from them.
double share_of_inside(const Eigen::Vector3d& u, const Eigen::Vector3d& w, const Eigen::Vector3d& point) {
    const Eigen::Vector3d along = (w - u).stableNormalized();
    const double of_u = along.dot((point - u).stableNormalized()),
                 of_w = along.dot((w - point).stableNormalized());
    return std::clamp(of_u / most_lean, 0.0, 1.0) * std::clamp(of_w / most_lean, 0.0, 1.0);
}

/// The share of a face in what presses a vertex away from it.
double share_of_face(const MovingSurface& surface, int face, const Eigen::Vector3d& vertex,
                     const ClosestPoints& nearest, double share) {
    std::array<int, 3> corners{};
    int count = 0;
    for (int k = 0; k < 3; ++k)
        if (nearest.weights_b[k] != 0) corners[count++] = surface.F()(face, k);
    if (count == 3) return 1;
    const SurfaceTopology& topology = surface.topology();
    int around = 0;
    for (int i = topology.vertex_begin[corners[0]]; i < topology.vertex_begin[corners[0] + 1]; ++i) {
        const int other = topology.vertex_faces[i];
        const auto of_other = surface.F().row(other);
        if (count == 2 && (of_other.array() != corners[1]).all()) continue;
        ++around;
        if (other == face) continue;
        const ClosestPoints of =
            closest_point_triangle(vertex, surface.at(of_other[0], share), surface.at(of_other[1], share),
                                   surface.at(of_other[2], share));
        if (of.distance < (1 - rounding) * nearest.distance) return 0;
    }
    return 1.0 / around;
}

double mollified(const MovingSurface& a, int edge_a, const MovingSurface& b, int edge_b,
                 const std::array<Eigen::Vector3d, 4>& x) {
    const auto rest = [](const MovingSurface& surface, int edge) {
        const auto ends = surface.topology().edges.row(edge);
        return (surface.rest().row(ends[1]) - surface.rest().row(ends[0])).squaredNorm();
    };
    return edge_mollifier(x[1] - x[0], x[3] - x[2], rest(a, edge_a), rest(b, edge_b));
}

}  // namespace

double pair_weight(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces, double share,
                   double most_rise) {
    const MovingSurface &a = surfaces[pair.surface_a], &b = surfaces[pair.surface_b];
    std::array<Eigen::Vector3d, 4> x;
    const auto at = corners(pair, surfaces);
    for (std::size_t k = 0; k < 4; ++k) x[k] = surfaces[at[k].surface].at(at[k].vertex, share);
    const bool is_vertex_face = pair.kind == FeatureKind::vertex_face;
    double weight = is_vertex_face ? 1 : mollified(a, pair.a, b, pair.b, x);
    if (pair.surface_a == pair.surface_b || weight == 0) return weight;
    const ClosestPoints nearest = closest_points(pair.kind, x);
    Eigen::Vector3d motion = Eigen::Vector3d::Zero();  // of a relative to b, where they are nearest
    for (std::size_t k = 0, of_a = corners_of_a(pair.kind); k < 4 && std::isfinite(most_rise); ++k) {
        const MovingSurface& surface = surfaces[at[k].surface];
        const double w = k < of_a ? nearest.weights_a[k] : -nearest.weights_b[k - of_a];
        motion += w * (surface.end(at[k].vertex) - surface.begin(at[k].vertex)).transpose();
    }
    const Eigen::Vector3d toward_a = nearest.gap.stableNormalized();  // from b
    Lean from_a(-toward_a, -motion), from_b(toward_a, motion);
    if (is_vertex_face) {
        weight = share_of_face(b, pair.b, x[0], nearest, share);
        from_a.add_vertex(a, pair.a, share);
    } else {
        const Eigen::Vector3d on_a = nearest.weights_a[0] * x[0] + nearest.weights_a[1] * x[1],
                              on_b = nearest.weights_b[0] * x[2] + nearest.weights_b[1] * x[3];
        weight *= share_of_inside(x[0], x[1], on_b) * share_of_inside(x[2], x[3], on_a);
        if (weight == 0) return 0;
        from_a.add_edge(a, pair.a, share);
        from_b.add_edge(b, pair.b, share);
    }
    return weight * std::min(from_a.weight(most_rise), from_b.weight(most_rise));
}

}  // namespace nbd
