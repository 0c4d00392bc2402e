#include "meshing/body/embed.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "meshing/surface/box_tree.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "meshing/surface/weld.hpp"

namespace nbd {
namespace {

/// Finds the tetrahedron of a point and its barycentric weights there.
class TetLocator {
 public:
    explicit TetLocator(const TetMesh& tets)
        : tets_(tets), to_weights_(checked_inverses(tets)), tree_(boxes(tets)) {}

    Eigen::Vector4d weights(int t, const Eigen::Vector3d& x) const {
        const Eigen::Vector3d w = to_weights_[t] * (x - corner(t, 0));
        return {1 - w.sum(), w[0], w[1], w[2]};
    }

    /// The tetrahedron in which x lies deepest; -1 if x is outside all of them by more than rounding.
    int holding(const Eigen::Vector3d& x) const {
        constexpr double rounding = 1e-9;  // relative to a tetrahedron's height
        int best = -1;
        double depth = -rounding;
        tree_.overlapping(BoxTree::Box(x, x), [&](int t) {
            const double least = weights(t, x).minCoeff();
            if (least > depth || (least == depth && t < best)) best = t, depth = least;
        });
        return best;
    }

    /// The nearest tetrahedron to an outside point and its distance in metres.
    std::pair<int, double> nearest(const Eigen::Vector3d& x) const {
        const auto [t, squared] = tree_.nearest(x, [&](int i) { return squared_distance(i, x); });
        return {t, std::sqrt(squared)};
    }

    double mean_edge(int t) const {
        double sum = 0;
        for (int i = 0; i < 4; ++i)
            for (int j = i + 1; j < 4; ++j) sum += (corner(t, i) - corner(t, j)).norm();
        return sum / 6;
    }

 private:
    static std::vector<Eigen::Matrix3d> checked_inverses(const TetMesh& tets) {
        if (tets.T.rows() == 0) throw std::invalid_argument("no tetrahedra to embed in");
        std::vector<Eigen::Matrix3d> inverses(tets.T.rows());
        for (int t = 0; t < tets.T.rows(); ++t) {
            for (const int v : tets.T.row(t))
                if (v < 0 || v >= tets.X.rows())
                    throw std::invalid_argument(fmt::format(
                        "tetrahedron {} refers to node {}, but there are {} nodes", t, v, tets.X.rows()));
            Eigen::Matrix3d edges;
            for (int k = 0; k < 3; ++k)
                edges.col(k) = (tets.X.row(tets.T(t, k + 1)) - tets.X.row(tets.T(t, 0))).transpose();
            const double volume = edges.determinant() / 6;
            if (!(volume > 0) || !std::isfinite(volume))
                throw std::invalid_argument(
                    fmt::format("tetrahedron {} has volume {:.6g} m3; allowed: more than 0", t, volume));
            inverses[t] = edges.inverse();
        }
        return inverses;
    }

    static std::vector<BoxTree::Box> boxes(const TetMesh& tets) {
        std::vector<BoxTree::Box> boxes(tets.T.rows());
        for (int t = 0; t < tets.T.rows(); ++t)
            for (const int v : tets.T.row(t)) boxes[t].extend(tets.X.row(v).transpose());
        return boxes;
    }

    Eigen::Vector3d corner(int t, int k) const { return tets_.X.row(tets_.T(t, k)); }

    double squared_distance(int t, const Eigen::Vector3d& x) const {
        const Eigen::Vector3d a = corner(t, 0), b = corner(t, 1), c = corner(t, 2), d = corner(t, 3);
        return std::min({squared_distance_to_triangle(x, a, b, c), squared_distance_to_triangle(x, a, b, d),
                         squared_distance_to_triangle(x, a, c, d), squared_distance_to_triangle(x, b, c, d)});
    }

    const TetMesh& tets_;
    std::vector<Eigen::Matrix3d> to_weights_;  // maps x - corner 0 to the weights of corners 1 to 3
    BoxTree tree_;
};

/// Counts misfitting points and keeps the message of the first.
struct Misfits {
    int count = 0;
    std::string first;
    void add(std::string text) {
        if (count++ == 0) first = std::move(text);
    }
    void check() const {
        if (count > 0)
            throw std::invalid_argument(
                fmt::format("{}; {} such {}", first, count, count == 1 ? "vertex" : "vertices"));
    }
};

std::string name_point(NodesRef points, int p) {
    return fmt::format("vertex {} at ({:.6g}, {:.6g}, {:.6g})", p, points(p, 0), points(p, 1), points(p, 2));
}

/// Of the corners of tetrahedra: only these lie where their nodes do in every pose.
PositionIndex corner_index(const TetMesh& tets, std::vector<int>& node_of) {
    PositionIndex index;
    std::vector<char> is_corner(tets.X.rows(), 0);
    for (const int v : tets.T.reshaped()) is_corner[v] = 1;
    for (int v = 0; v < tets.X.rows(); ++v)
        if (is_corner[v] && index.insert(tets.X.row(v)) == std::ssize(node_of)) node_of.push_back(v);
    return index;
}

/// z: barycentric coordinates of the point in tetrahedron t.
void add_weights(const TetMesh& tets, int point, int t, Eigen::Vector4d z,
                 std::vector<Eigen::Triplet<double>>& entries) {
    if (!tets.is_quadratic()) {
        for (int a = 0; a < 4; ++a) entries.emplace_back(point, tets.T(t, a), z[a]);
        return;
    }
    constexpr double rounding = 1e-12;  // a point on a face takes no weights of the nodes beside it
    z = (z.array().abs() > rounding).select(z, 0);
    z /= z.sum();
    for (int a = 0; a < 4; ++a)
        if (z[a] != 0) entries.emplace_back(point, tets.T(t, a), z[a] * z[a]);
    for (std::size_t k = 0; k < edges_of_tet.size(); ++k) {
        const auto [a, b] = edges_of_tet[k];
        if (const double w = 2 * z[a] * z[b]; w != 0) entries.emplace_back(point, tets.E(t, k), w);
    }
}

}  // namespace

Embedding embed(const TetMesh& tets, NodesRef points, const EmbedConfig& config) {
    constexpr double max_distance = 0.5;  // in mean edge lengths
    const TetLocator locator(tets);
    std::vector<int> node_of;
    const PositionIndex nodes = corner_index(tets, node_of);
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(4 * points.rows());
    Misfits far;
    for (int p = 0; p < points.rows(); ++p) {
        const Eigen::Vector3d x = points.row(p);
        if (!x.allFinite()) throw std::invalid_argument(name_point(points, p) + " is not finite");
        if (const int node = nodes.find(points.row(p)); node >= 0) {
            entries.emplace_back(p, node_of[node], 1);
            continue;
        }
        int t = locator.holding(x);
        if (t < 0) {
            const auto [nearest, distance] = locator.nearest(x);
            const double edge = locator.mean_edge(nearest);
            if (config.only_inside)
                far.add(
                    fmt::format("{} lies {:.3g} m outside the tetrahedra", name_point(points, p), distance));
            else if (distance > max_distance * edge)
                far.add(
                    fmt::format("{} is {:.6g} m away from the nearest tetrahedron ({}), "
                                "more than {} of its mean edge length {:.6g} m",
                                name_point(points, p), distance, nearest, max_distance, edge));
            t = nearest;
        }
        Eigen::Vector4d w = locator.weights(t, x);
        if (config.only_inside) w = w.cwiseMax(0) / w.cwiseMax(0).sum();
        add_weights(tets, p, t, w, entries);
    }
    far.check();
    Embedding W(points.rows(), tets.X.rows());
    W.setFromTriplets(entries.begin(), entries.end());
    return W;
}

}  // namespace nbd
