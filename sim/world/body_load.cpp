#include "sim/world/body_load.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>
#include <tuple>

#include "meshing/body/embed.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/fem/quadratic_points.hpp"

namespace nbd {
namespace {

void check_rows(std::vector<int> rows, int count, const char* what) {
    std::ranges::sort(rows);
    if (!rows.empty() && (rows.front() < 0 || rows.back() >= count))
        throw std::invalid_argument(fmt::format("load: {} {} is not in 0..{}", what,
                                                rows.front() < 0 ? rows.front() : rows.back(), count - 1));
    if (const auto twice = std::ranges::adjacent_find(rows); twice != rows.end())
        throw std::invalid_argument(fmt::format("load: {} {} is named twice", what, *twice));
}

void check_factor(const Keyed<double>& factor) {
    if (factor.times.size() != factor.values.size())
        throw std::invalid_argument("load: its factor needs a value for each time");
    if (!factor.is_sound([](double value) { return std::isfinite(value); }))
        throw std::invalid_argument("load: its factor needs finite values at times that increase");
}

Eigen::Vector3d weighted_mean(NodesRef x, const std::vector<int>& nodes, const Eigen::VectorXd& weights) {
    const Eigen::RowVector3d first = x.row(nodes.front());  // far from the origin, differences are exact
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    for (std::size_t k = 0; k < nodes.size(); ++k) sum += weights[k] * (x.row(nodes[k]) - first);
    return (first + sum / weights.sum()).transpose();
}

/// Of the weights about a centre.
Eigen::Matrix3d inertia_about(const Eigen::Vector3d& centre, NodesRef x, const std::vector<int>& nodes,
                              const Eigen::VectorXd& weights) {
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        const Eigen::Vector3d r = x.row(nodes[k]).transpose() - centre;
        moments += weights[k] * r * r.transpose();
    }
    return moments.trace() * Eigen::Matrix3d::Identity() - moments;
}

Eigen::Vector3d position(const Embedding& W, int row, NodesRef x) {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    for (Embedding::InnerIterator it(W, row); it; ++it) p += it.value() * x.row(it.col()).transpose();
    return p;
}

/// A force on a point, to the nodes that it hangs on.
void pass_on(const Embedding& W, int row, const Eigen::Vector3d& force, Nodes& out) {
    for (Embedding::InnerIterator it(W, row); it; ++it) out.row(it.col()) += it.value() * force.transpose();
}

/// A point of integration in a triangle: its share of the area, and its coordinates.
struct TrianglePoint {
    double weight;
    Eigen::Vector3d L;
};

/// Exact for polynomials of degree four. Source: [Dunavant85].
std::array<TrianglePoint, 6> triangle_points() {
    constexpr double near = 0.445948490915965, far = 0.091576213509771;
    std::array<TrianglePoint, 6> points;
    for (int k = 0; k < 3; ++k)
        for (const auto& [first, share, value] :
             {std::tuple(0, 0.223381589678011, near), std::tuple(3, 0.109951743655322, far)}) {
            TrianglePoint& point = points[first + k];
            point.weight = share;
            point.L.setConstant(value);
            point.L[k] = 1 - 2 * value;
        }
    return points;
}

/// Of a triangle's coordinate by the second and the third.
Eigen::RowVector2d coordinate_slope(int coordinate) {
    if (coordinate == 0) return {-1, -1};
    return coordinate == 1 ? Eigen::RowVector2d(1, 0) : Eigen::RowVector2d(0, 1);
}

}  // namespace

void check_gas(const BodyLoad& load, const ElasticBody& elastic) {
    const CavityGas& gas = load.gas;
    check_factor(load.factor);
    if (!(gas.pressure > 0 && std::isfinite(gas.pressure) && gas.ambient >= 0 && std::isfinite(gas.ambient)))
        throw std::invalid_argument(
            "load: a gas needs an absolute pressure above 0, and an ambient one of 0 or more");
    constexpr double least = 1, most = 10;
    if (!(gas.exponent >= least && gas.exponent <= most))
        throw std::invalid_argument(
            fmt::format("load: the exponent of a gas is {}, allowed: 1 to 10", gas.exponent));
    if (std::ranges::any_of(load.factor.values, [](double amount) { return !(amount >= 0); }))
        throw std::invalid_argument("load: the factor of a gas, of its amount, must not be negative");
    if (elastic.is_rigid()) throw std::invalid_argument("load: a rigid body's cavities keep their volumes");
}

LoadForces::LoadForces(BodyLoad load, const ElasticBody& elastic, const ContactShape& shape)
    : load_(std::move(load)), nodes_(load_.nodes), shape_(&shape) {
    check_rows(load_.nodes, elastic.node_count(), "node");
    check_rows(load_.faces, shape.F.rows(), "face");
    check_factor(load_.factor);
    if (!load_.value.allFinite() || !std::isfinite(load_.pressure) || !std::isfinite(load_.tension))
        throw std::invalid_argument("load: it is not finite");
    if (load_.kind == LoadKind::muscle) {
        find_fibres(elastic);
        return;
    }
    if (load_.kind == LoadKind::pressure) {
        faces_ = load_.faces;
        if (faces_.empty()) {
            faces_.resize(shape.F.rows());
            std::iota(faces_.begin(), faces_.end(), 0);
        }
        if (elastic.rest().is_quadratic()) find_middles(elastic);
        return;
    }
    if (nodes_.empty()) {
        nodes_.resize(elastic.node_count());
        std::iota(nodes_.begin(), nodes_.end(), 0);
    }
    weights_ = elastic.node_masses()(nodes_);
    if (!load_.shares.empty()) {
        weights_ = Eigen::Map<const Eigen::VectorXd>(load_.shares.data(), std::ssize(load_.shares));
        if (load_.kind != LoadKind::force || load_.shares.size() != load_.nodes.size() ||
            !weights_.allFinite() || !(weights_.sum() > 0))
            throw std::invalid_argument("load: a force needs a share for each of its nodes, with a sum > 0");
    }
    if (load_.kind != LoadKind::torque) return;
    const Nodes& X = elastic.rest().X;
    const Eigen::Matrix3d inertia = inertia_about(weighted_mean(X, nodes_, weights_), X, nodes_, weights_);
    if (!(std::abs(inertia.determinant()) > 1e-9 * std::pow(inertia.trace() / 3, 3)))
        throw std::invalid_argument("load: a torque needs nodes that do not lie on one line");
}

void LoadForces::add(NodesRef x, double factor, Nodes& out) const {
    if (factor == 0) return;
    if (load_.kind == LoadKind::torque) return add_torque(x, factor, out);
    if (load_.kind == LoadKind::pressure) return add_pressure(x, factor, out);
    if (load_.kind == LoadKind::muscle) return add_muscle(x, factor, out);
    const double share = load_.kind == LoadKind::force ? 1 / weights_.sum() : 1;
    for (std::size_t k = 0; k < nodes_.size(); ++k)
        out.row(nodes_[k]) += factor * share * weights_[k] * load_.value.transpose();
}

void LoadForces::add_torque(NodesRef x, double factor, Nodes& out) const {
    const Eigen::Vector3d centre = weighted_mean(x, nodes_, weights_);
    const Eigen::Vector3d turn =
        inertia_about(centre, x, nodes_, weights_).partialPivLu().solve(factor * load_.value);
    for (std::size_t k = 0; k < nodes_.size(); ++k)
        out.row(nodes_[k]) += weights_[k] * turn.cross(x.row(nodes_[k]).transpose() - centre).transpose();
}

/// At the points where elasticity is integrated, too.
void LoadForces::find_fibres(const ElasticBody& elastic) {
    const TetMesh& rest = elastic.rest();
    check_rows(load_.tets, elastic.element_count(), "tetrahedron");
    if (load_.tets.empty() || load_.fibres.size() != load_.tets.size())
        throw std::invalid_argument("load: a muscle needs tetrahedra, and a direction of fibres for each");
    constexpr double rounding = 1e-6;
    for (std::size_t k = 0; k < load_.tets.size(); ++k) {
        const int t = load_.tets[k];
        const Eigen::Vector3d& d = load_.fibres[k];
        if (!(std::abs(d.norm() - 1) <= rounding))
            throw std::invalid_argument("load: the direction of a muscle's fibres needs the length 1");
        Eigen::Matrix3d edges;
        for (int a = 0; a < 3; ++a)
            edges.col(a) = (rest.X.row(rest.T(t, a + 1)) - rest.X.row(rest.T(t, 0))).transpose();
        Eigen::Vector4d slopes;  // of barycentric coordinates along the fibres, 1/m
        slopes.tail<3>() = edges.partialPivLu().solve(d);
        slopes[0] = -slopes.tail<3>().sum();
        const double volume = elastic.rest_volumes()[t];
        const std::vector<int> corners{rest.T(t, 0), rest.T(t, 1), rest.T(t, 2), rest.T(t, 3)};
        if (!rest.is_quadratic()) {
            fibres_.push_back({volume, corners, {slopes[0], slopes[1], slopes[2], slopes[3]}});
            continue;
        }
        Eigen::Matrix<double, 1, 10> fill = Eigen::Matrix<double, 1, 10>::Constant(0.1);  // a full one
        if (rest.fill.rows() > 0) fill = rest.fill.row(t);
        const TetPoints points = points_of_fill(fill);
        for (int p = 0; p < 4; ++p) {  // nodes are control points: shape functions L_a^2 and 2 L_a L_b
            Fibre& fibre = fibres_.emplace_back(Fibre{volume / 4, corners, {}});
            for (int a = 0; a < 4; ++a) fibre.factors.push_back(2 * points(p, a) * slopes[a]);
            for (std::size_t e = 0; e < edges_of_tet.size(); ++e) {
                const auto [a, b] = edges_of_tet[e];
                fibre.nodes.push_back(rest.E(t, e));
                fibre.factors.push_back(2 * (points(p, a) * slopes[b] + points(p, b) * slopes[a]));
            }
        }
    }
}

Eigen::RowVector3d LoadForces::Fibre::stretched(NodesRef x) const {
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    for (std::size_t k = 0; k < nodes.size(); ++k) sum += factors[k] * x.row(nodes[k]);
    return sum;
}

/// Minus the derivative of the potential.
void LoadForces::add_muscle(NodesRef x, double factor, Nodes& out) const {
    for (const Fibre& fibre : fibres_) {
        const Eigen::RowVector3d stretched = fibre.stretched(x);
        const double length = stretched.norm();
        if (!(length > 0)) continue;
        const Eigen::RowVector3d pull = factor * load_.tension * fibre.volume / length * stretched;
        for (std::size_t k = 0; k < fibre.nodes.size(); ++k)
            out.row(fibre.nodes[k]) -= fibre.factors[k] * pull;
    }
}

/// The second derivative of the potential.
void LoadForces::add_springs(NodesRef x, double factor, std::vector<NodeSpring>& out) const {
    if (!(factor * load_.tension > 0)) return;
    for (const Fibre& fibre : fibres_) {
        const Eigen::RowVector3d stretched = fibre.stretched(x);
        const double length = stretched.norm();
        if (!(length > 0)) continue;
        const Eigen::Vector3d e = stretched.transpose() / length;
        out.push_back({fibre.nodes, fibre.factors,
                       factor * load_.tension * fibre.volume / length *
                           (Eigen::Matrix3d::Identity() - e * e.transpose())});
    }
}

/// Of quadratic bodies: a face is a quadratic triangle through its corners and the middles of its edges, so
/// that a pressure does on it what it does on the bodies' own curved faces.
void LoadForces::find_middles(const ElasticBody& elastic) {
    const Nodes rest = embedded(shape_->W, elastic.rest().X);
    std::map<std::array<int, 2>, int> number;
    std::vector<Eigen::RowVector3d> points;
    for (const int face : faces_) {
        const auto corners = shape_->F.row(face);
        std::array<int, 3>& middles = middles_of_.emplace_back();
        for (int k = 0; k < 3; ++k) {
            const int from = corners[k], to = corners[(k + 1) % 3];
            const int least = std::min(from, to), most = std::max(from, to);
            const auto [known, is_new] = number.try_emplace({least, most}, std::ssize(points));
            if (is_new) points.push_back((rest.row(least) + rest.row(most)) / 2);
            middles[k] = known->second;
        }
    }
    Nodes at(std::ssize(points), 3);
    for (std::size_t i = 0; i < points.size(); ++i) at.row(i) = points[i];
    middles_ = embed(elastic.rest(), at);
}

/// A flat face passes a third of its force on to each corner, and a corner to the nodes that it hangs on.
void LoadForces::add_pressure(NodesRef x, double factor, Nodes& out) const {
    if (!middles_of_.empty()) return add_curved_pressure(x, factor, out);
    for (const int face : faces_) {
        const auto corners = shape_->F.row(face);
        const Eigen::Vector3d a = position(shape_->W, corners[0], x), b = position(shape_->W, corners[1], x),
                              c = position(shape_->W, corners[2], x);
        const Eigen::Vector3d force = -factor * load_.pressure / 6 * (b - a).cross(c - a);
        for (const int vertex : corners) pass_on(shape_->W, vertex, force, out);
    }
}

/// By the integral of each corner's and middle's shape function times the normal: the derivative of the
/// volume behind the face.
void LoadForces::add_curved_pressure(NodesRef x, double factor, Nodes& out) const {
    for (std::size_t f = 0; f < faces_.size(); ++f) {
        const auto corners = shape_->F.row(faces_[f]);
        Eigen::Matrix<double, 3, 6> at, forces = Eigen::Matrix<double, 3, 6>::Zero();
        for (int k = 0; k < 3; ++k) {
            at.col(k) = position(shape_->W, corners[k], x);
            at.col(3 + k) = position(middles_, middles_of_[f][k], x);
        }
        for (const auto& [weight, L] : triangle_points()) {
            Eigen::Vector<double, 6> N;
            Eigen::Matrix<double, 6, 2> slopes;  // by the second and third coordinate
            for (int k = 0; k < 3; ++k) {
                const int l = (k + 1) % 3;
                const Eigen::RowVector2d of_k = coordinate_slope(k), of_l = coordinate_slope(l);
                N[k] = L[k] * (2 * L[k] - 1);
                slopes.row(k) = (4 * L[k] - 1) * of_k;
                N[3 + k] = 4 * L[k] * L[l];
                slopes.row(3 + k) = 4 * (L[l] * of_k + L[k] * of_l);
            }
            const Eigen::Matrix<double, 3, 2> tangents = at * slopes;
            forces -=
                factor * load_.pressure / 2 * weight * tangents.col(0).cross(tangents.col(1)) * N.transpose();
        }
        for (int k = 0; k < 3; ++k) {
            pass_on(shape_->W, corners[k], forces.col(k), out);
            pass_on(middles_, middles_of_[f][k], forces.col(3 + k), out);
        }
    }
}

}  // namespace nbd
