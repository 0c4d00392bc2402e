#include "sim/fem/modes.hpp"

#include <arpack.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "collision/base/counter_random.hpp"
#include "collision/base/stop.hpp"
#include "meshing/progress/progress.hpp"
#include "sim/factor/cholesky.hpp"

namespace nbd {
namespace {

constexpr int rigid_count = 6;
constexpr double tolerance = 1e-12;        // ARPACK's, relative, of eigenvalues
constexpr double zero_eigenvalue = 1e-12;  // times Pencil::large; rounding stays below, elastic modes above
constexpr double shift_below_zero = 1e-8;  // likewise; keeps K - sigma M well conditioned

// Entry i of a random vector with entries in [-1, 1).
double seeded_uniform(std::uint64_t seed, std::uint64_t i) {
    return 2 * unit_interval(mix_bits(seed * golden_step + (i + 1) * 0xbf58476d1ce4e5b9u)) - 1;
}

struct Pencil {
    const ElasticBody& body;
    SparseMatrix K, M;
    double large;  // the mean of the eigenvalues, weighted with masses: nodes with hardly any do not count

    explicit Pencil(const ElasticBody& b)
        : body(b),
          K(b.rest_stiffness()),
          M(b.mass_matrix()),
          large(K.diagonal().sum() / M.diagonal().sum()) {}
};

struct EigenPairs {
    Eigen::VectorXd values;   // ascending
    Eigen::MatrixXd vectors;  // columns, M-orthonormal
    int solves = 0;
};

// The `count` eigenpairs with the smallest absolute eigenvalues.
EigenPairs lowest_pairs(const Pencil& pencil, int count, const ModeOptions& options) {
    const int n = pencil.body.unknown_count();
    const double sigma = -shift_below_zero * pencil.large;
    Cholesky shifted;
    {
        const SparseMatrix A = pencil.K - sigma * pencil.M;
        shifted.analyze(A);
        shifted.factorize(A);
    }

    // ARPACK keeps its state in static variables.
    static std::mutex arpack;
    const std::lock_guard lock(arpack);
    const int basis = std::min(n, std::max(2 * count, count + 20));
    Eigen::VectorXd residual(n), work_d(3 * n), work_l(basis * (basis + 8));
    for (int i = 0; i < n; ++i) residual[i] = seeded_uniform(options.seed, i);
    EigenPairs pairs;
    pairs.vectors.resize(n, basis);
    int iparam[11] = {}, ipntr[14] = {};
    iparam[0] = 1;     // exact shifts
    iparam[2] = 1000;  // maximum number of restarts
    iparam[3] = 1;
    iparam[6] = 3;           // shift-invert mode
    int task = 0, info = 1;  // info = 1: start from `residual`
    while (true) {
        tell_progress("solves", pairs.solves, 0);
        stop_if_asked();
        dsaupd_c(&task, "G", n, "LM", count, tolerance, residual.data(), basis, pairs.vectors.data(), n,
                 iparam, ipntr, work_d.data(), work_l.data(), work_l.size(), &info);
        auto x = work_d.segment(ipntr[0] - 1, n);
        auto y = work_d.segment(ipntr[1] - 1, n);
        if (task == 2) {
            y = pencil.M * x;
        } else if (task == 1) {
            shifted.solve(work_d.segment(ipntr[2] - 1, n), y);
            ++pairs.solves;
        } else if (task == -1) {
            y = pencil.M * x;
            shifted.solve(y, y);
            ++pairs.solves;
        } else {
            break;
        }
    }
    const int converged = iparam[4];
    if (info != 0 || converged < count)
        throw std::runtime_error(
            fmt::format("modes: ARPACK found {} of {} eigenpairs (dsaupd info {})", converged, count, info));
    std::vector<int> select(basis, 1);
    Eigen::VectorXd values(count);
    dseupd_c(1, "A", select.data(), values.data(), pairs.vectors.data(), n, sigma, "G", n, "LM", count,
             tolerance, residual.data(), basis, pairs.vectors.data(), n, iparam, ipntr, work_d.data(),
             work_l.data(), work_l.size(), &info);
    if (info != 0) throw std::runtime_error(fmt::format("modes: ARPACK's dseupd failed with info {}", info));

    std::vector<int> order(count);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return values[a] < values[b]; });
    pairs.values = values(order);
    pairs.vectors = pairs.vectors(Eigen::all, order).eval();
    return pairs;
}

// Translations and infinitesimal rotations about the centre of mass, as M-normalised columns.
Eigen::MatrixXd rigid_motions(const Pencil& pencil) {
    const Nodes& X = pencil.body.rest().X;
    const Eigen::VectorXd& m = pencil.body.node_masses();
    const Eigen::RowVector3d centre = (m.transpose() * X) / m.sum();
    Eigen::MatrixXd motions = Eigen::MatrixXd::Zero(3 * X.rows(), rigid_count);
    for (Eigen::Index i = 0; i < X.rows(); ++i) {
        const Eigen::Vector3d arm = (X.row(i) - centre).transpose();
        for (int axis = 0; axis < 3; ++axis) {
            motions(3 * i + axis, axis) = 1;
            motions.block<3, 1>(3 * i, 3 + axis) = Eigen::Vector3d::Unit(axis).cross(arm);
        }
    }
    for (int c = 0; c < rigid_count; ++c)
        motions.col(c) /= std::sqrt(motions.col(c).dot(pencil.M * motions.col(c)));
    return motions;
}

// Largest M-norm of the part of a unit rigid motion that lies outside the span of `modes`.
double rigid_residual(const Pencil& pencil, const Eigen::Ref<const Eigen::MatrixXd>& modes) {
    const Eigen::MatrixXd motions = rigid_motions(pencil),
                          rest = motions - modes * (modes.transpose() * (pencil.M * motions)),
                          product = pencil.M * rest;
    return std::sqrt(rest.cwiseProduct(product).colwise().sum().maxCoeff());
}

// Throws unless there are exactly six rigid modes and they span the rigid motions.
void check_rigid(const Pencil& pencil, const EigenPairs& pairs, ModeReport& report) {
    const double zero = zero_eigenvalue * pencil.large;
    const auto found = (pairs.values.array() <= zero).count();
    if (found != rigid_count)
        throw std::runtime_error(
            fmt::format("modes: found {}{} rigid modes, but a free body in one piece has exactly 6; "
                        "check for separate or hinged parts",
                        found == pairs.values.size() ? "at least " : "", found));
    const double largest = pairs.values.head<rigid_count>().cwiseAbs().maxCoeff();
    report.max_rigid_hz = std::sqrt(largest) / (2 * std::numbers::pi);
    report.gap = pairs.values[rigid_count] / largest;
    report.rigid_residual = rigid_residual(pencil, pairs.vectors.leftCols<rigid_count>());
    constexpr double allowed = 1e-5;
    if (report.rigid_residual > allowed)
        throw std::runtime_error(
            fmt::format("modes: the six lowest modes miss a rigid motion by {}, allowed: {}",
                        report.rigid_residual, allowed));
}

void measure_accuracy(const Pencil& pencil, const EigenPairs& pairs, ModeReport& report) {
    const Eigen::MatrixXd MU = pencil.M * pairs.vectors, KU = pencil.K * pairs.vectors,
                          expected = MU * pairs.values.asDiagonal();
    const Eigen::Index elastic = pairs.values.size() - rigid_count;
    report.max_residual = ((KU - expected).colwise().norm().array() / expected.colwise().norm().array())
                              .tail(elastic)
                              .maxCoeff();
    const Eigen::MatrixXd gram = pairs.vectors.transpose() * MU;
    report.orthonormality =
        (gram - Eigen::MatrixXd::Identity(gram.rows(), gram.cols())).cwiseAbs().maxCoeff();
}

}  // namespace

int most_modes(int nodes) noexcept { return 3 * nodes - rigid_count - 1; }

Modes vibration_modes(const ElasticBody& body, const ModeOptions& options) {
    const int most = most_modes(body.node_count());
    if (options.count < 1 || options.count > most)
        throw std::invalid_argument(fmt::format("modes: count is {}, allowed: 1 to {} for {} nodes",
                                                options.count, most, body.node_count()));
    const Pencil pencil(body);
    EigenPairs pairs = lowest_pairs(pencil, options.count + rigid_count, options);

    Modes modes;
    check_rigid(pencil, pairs, modes.report);
    measure_accuracy(pencil, pairs, modes.report);
    modes.report.solves = pairs.solves;
    auto elastic = pairs.vectors.rightCols(options.count);
    for (int c = 0; c < options.count; ++c) {
        Eigen::Index largest = 0;
        elastic.col(c).cwiseAbs().maxCoeff(&largest);
        if (elastic(largest, c) < 0) elastic.col(c) *= -1;
    }
    modes.basis.U = elastic.cast<float>();
    modes.basis.frequencies.resize(options.count);
    for (int c = 0; c < options.count; ++c)
        modes.basis.frequencies[c] = std::sqrt(pairs.values[rigid_count + c]) / (2 * std::numbers::pi);
    return modes;
}

}  // namespace nbd
