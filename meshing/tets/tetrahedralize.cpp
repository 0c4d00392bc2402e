#include "meshing/tets/tetrahedralize.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "collision/base/stop.hpp"
#include "meshing/tets/gmsh_volume.hpp"

namespace nbd {
namespace {

/// Finds the nearest of a fixed set of points by a balanced k-d tree. Queries are const and thread-safe.
class NearestVertex {
 public:
    struct Hit {
        int vertex = -1;  // row of the points
        double distance = 0;
    };

    /// points: at least one row, finite; copied.
    explicit NearestVertex(NodesRef points);

    /// The nearest point to `p`. Ties are resolved in a fixed way.
    Hit find(const Eigen::Vector3d& p) const noexcept;

 private:
    void sort(int begin, int end) noexcept;
    void search(int begin, int end, const Eigen::Vector3d& p, Hit& best) const noexcept;

    Nodes points_;
    std::vector<int> order_;           // the median of a range is the node, its halves are the children
    std::vector<unsigned char> axis_;  // splitting axis, per position in order_
};

NearestVertex::NearestVertex(NodesRef points) : points_(points), order_(points.rows()), axis_(order_.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    sort(0, order_.size());
}

void NearestVertex::sort(int begin, int end) noexcept {
    if (begin >= end) return;
    Eigen::RowVector3d low = points_.row(order_[begin]), high = low;
    for (int i = begin + 1; i < end; ++i) {
        low = low.cwiseMin(points_.row(order_[i]));
        high = high.cwiseMax(points_.row(order_[i]));
    }
    int axis = 0;
    (high - low).maxCoeff(&axis);
    const int middle = begin + (end - begin) / 2;
    // Ties are broken by row, so the tree does not depend on the library's selection algorithm.
    std::nth_element(
        order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](int a, int b) {
            return points_(a, axis) != points_(b, axis) ? points_(a, axis) < points_(b, axis) : a < b;
        });
    axis_[middle] = static_cast<unsigned char>(axis);
    sort(begin, middle);
    sort(middle + 1, end);
}

void NearestVertex::search(int begin, int end, const Eigen::Vector3d& p, Hit& best) const noexcept {
    if (begin >= end) return;
    const int middle = begin + (end - begin) / 2;
    const int vertex = order_[middle];
    const double distance = (points_.row(vertex).transpose() - p).norm();
    if (distance < best.distance) best = {vertex, distance};
    const double offset = p[axis_[middle]] - points_(vertex, axis_[middle]);
    const bool left_first = offset < 0;
    search(left_first ? begin : middle + 1, left_first ? middle : end, p, best);
    if (std::abs(offset) < best.distance)
        search(left_first ? middle + 1 : begin, left_first ? end : middle, p, best);
}

NearestVertex::Hit NearestVertex::find(const Eigen::Vector3d& p) const noexcept {
    Hit best{-1, std::numeric_limits<double>::infinity()};
    search(0, order_.size(), p, best);
    return best;
}

constexpr double max_grading = 2;          // more grading saves few nodes and creates slivers
constexpr double min_refinement = 1. / 3;  // gives 27 times the tetrahedra of grading 0

Eigen::VectorXd mean_edge_lengths(const TriMesh& surface) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(surface.X.rows()), count = sum;
    for (int f = 0; f < surface.F.rows(); ++f)
        for (int c = 0; c < 3; ++c) {
            const int a = surface.F(f, c), b = surface.F(f, (c + 1) % 3);
            const double length = (surface.X.row(a) - surface.X.row(b)).norm();
            for (const int v : {a, b}) {
                sum[v] += length;
                count[v] += 1;
            }
        }
    for (int v = 0; v < sum.size(); ++v)
        if (count[v] > 0) sum[v] /= count[v];
    return sum;
}

/// One parameter s for both settings: grading for s > 0, refinement for s < 0. It is scaled so that ln(inner
/// nodes) falls with a slope near -1.
struct Coarseness {
    double s = 0;
    static Coarseness of_grading(double grading) { return {std::log(grading / 0.1 + 1)}; }
    static Coarseness finest() { return {3 * std::log(min_refinement)}; }
    static Coarseness coarsest() { return of_grading(max_grading); }
    double grading() const { return s > 0 ? 0.1 * std::expm1(s) : 0; }
    double refinement() const { return s < 0 ? std::exp(s / 3) : 1; }
};

class Filler {
 public:
    explicit Filler(const TriMesh& surface)
        : surface_(surface), nearest_(surface.X), edge_(mean_edge_lengths(surface)) {}

    TetMesh fill(double grading, double refinement) {
        ++runs_;
        return fill_with_gmsh(surface_, [&](const Eigen::Vector3d& p) {
            stop_if_asked();
            const auto [vertex, distance] = nearest_.find(p);
            return refinement * (edge_[vertex] + grading * distance);
        });
    }
    int runs() const noexcept { return runs_; }

 private:
    const TriMesh& surface_;
    NearestVertex nearest_;
    Eigen::VectorXd edge_;
    int runs_ = 0;
};

/// ln of the number of inner nodes, the quantity that the search interpolates; counts at least half a node.
double log_inner(Eigen::Index nodes, Eigen::Index surface_nodes) {
    return std::log(std::max(0.5, static_cast<double>(nodes - surface_nodes)));
}

struct Sample {
    double s, log_nodes;
};

TetrahedralizeResult search_nodes(const TriMesh& surface, const TetrahedralizeConfig& config) {
    constexpr int max_runs = 16;
    const Eigen::Index on_surface = surface.X.rows();
    const double target = log_inner(config.nodes, on_surface);
    const double finest = Coarseness::finest().s, coarsest = Coarseness::coarsest().s;
    const auto out_of_reach = [&](Eigen::Index low, Eigen::Index high) {
        return NodesOutOfReach(
            fmt::format("{} nodes are not possible; allowed for a surface of {} vertices: about {} to {}",
                        config.nodes, on_surface, low, high),
            config.nodes > high);
    };
    const auto extrapolate = [&](const Sample& from, double s) {
        return on_surface + std::llround(std::exp(from.log_nodes + from.s - s));
    };

    Filler filler(surface);
    TetrahedralizeResult best;
    std::optional<Sample> many, few;  // nearest known samples on either side of the target
    double s = Coarseness::of_grading(TetrahedralizeConfig{}.grading).s;
    bool bisect = false;
    while (filler.runs() < max_runs) {
        const Coarseness knob{s};
        TetMesh tets = filler.fill(knob.grading(), knob.refinement());
        const Eigen::Index nodes = tets.X.rows();
        const Sample sample{s, log_inner(nodes, on_surface)};
        if (best.runs == 0 || std::abs(nodes - config.nodes) < std::abs(best.tets.X.rows() - config.nodes))
            best = {std::move(tets), knob.grading(), knob.refinement(), 1};
        if (std::abs(nodes - config.nodes) <= config.tolerance / 5 * config.nodes) break;

        auto& side = nodes > config.nodes ? many : few;
        const auto& other = nodes > config.nodes ? few : many;
        // Interpolation that moves only one end converges slowly, so every second step bisects.
        bisect = side.has_value() && other.has_value() && !bisect;
        side = sample;
        if (many && few) {
            const double t = (many->log_nodes - target) / (many->log_nodes - few->log_nodes);
            s = many->s + (bisect ? 0.5 : std::clamp(t, 0.05, 0.95)) * (few->s - many->s);
            continue;
        }
        if (s == (few ? finest : coarsest)) break;  // end of the range; the target lies beyond
        const double guess = s + sample.log_nodes - target;
        if (guess < finest - std::log(2.))
            throw out_of_reach(extrapolate(sample, coarsest), extrapolate(sample, finest));
        s = std::clamp(guess, finest, coarsest);
    }
    best.runs = filler.runs();
    if (std::abs(best.tets.X.rows() - config.nodes) <= config.tolerance * config.nodes) return best;
    if (!few) throw out_of_reach(best.tets.X.rows(), extrapolate(*many, finest));
    if (!many) throw out_of_reach(extrapolate(*few, coarsest), best.tets.X.rows());
    throw std::invalid_argument(
        fmt::format("no grading gives {} nodes within {} %; the nearest result has {} nodes", config.nodes,
                    100 * config.tolerance, best.tets.X.rows()));
}

}  // namespace

TetrahedralizeResult tetrahedralize(const TriMesh& surface, const TetrahedralizeConfig& config) {
    if (config.nodes < 0)
        throw std::invalid_argument(fmt::format("nodes is {}; allowed: 0 or more", config.nodes));
    if (!(config.tolerance > 0 && config.tolerance < 1))
        throw std::invalid_argument(
            fmt::format("tolerance is {}; allowed: between 0 and 1", config.tolerance));
    if (!(config.grading >= 0 && config.grading <= max_grading))
        throw std::invalid_argument(
            fmt::format("grading is {}; allowed: 0 to {}", config.grading, max_grading));
    if (surface.F.rows() < 4) throw std::invalid_argument("a closed surface has at least 4 faces");
    check_arrays(
        surface);  // gmsh aborts the process on other numbers and reads out of bounds on other indices
    TetrahedralizeResult result =
        config.nodes > 0
            ? search_nodes(surface, config)
            : TetrahedralizeResult{Filler(surface).fill(config.grading, 1), config.grading, 1, 1};
    const int nodes = result.tets.X.rows();
    const double most = config.nodes > 0 ? (1 + config.tolerance) * config.nodes : 2. * nodes;
    result.optimization = optimize_tets(result.tets, static_cast<int>(most) - nodes);
    return result;
}

}  // namespace nbd
