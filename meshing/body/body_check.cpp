#include "meshing/body/body_check.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <stdexcept>

namespace nbd {

namespace {

/// Throws naming the first non-finite row of m; `item` says what a row is.
template <class M>
void check_finite(const M& m, const char* item) {
    if (m.allFinite()) return;
    for (Eigen::Index i = 0; i < m.rows(); ++i)
        if (!m.row(i).allFinite())
            throw std::invalid_argument(fmt::format("{} {} is not finite; allowed: finite numbers", item, i));
}

template <class M>
void check_indices(const M& m, Eigen::Index count, const char* item, const char* target) {
    for (Eigen::Index i = 0; i < m.rows(); ++i)
        for (Eigen::Index k = 0; k < m.cols(); ++k)
            if (m(i, k) < 0 || m(i, k) >= count)
                throw std::invalid_argument(fmt::format("{} {} refers to {} {}; allowed: 0 to {}", item, i,
                                                        target, m(i, k), count - 1));
}

void check_tets(const TetMesh& tets) {
    if (tets.X.rows() < 4 || tets.T.rows() < 1)
        throw std::invalid_argument(fmt::format("{} nodes and {} tetrahedra; allowed: at least 4 and 1",
                                                tets.X.rows(), tets.T.rows()));
    check_finite(tets.X, "node");
    check_indices(tets.T, tets.X.rows(), "tetrahedron", "node");
    for (Eigen::Index t = 0; t < tets.T.rows(); ++t) {
        Eigen::Matrix3d edges;
        for (int k = 0; k < 3; ++k)
            edges.col(k) = (tets.X.row(tets.T(t, k + 1)) - tets.X.row(tets.T(t, 0))).transpose();
        if (const double volume = edges.determinant() / 6; !(volume > 0))
            throw std::invalid_argument(
                fmt::format("tetrahedron {} has volume {:.3g} m3; allowed: more than 0", t, volume));
    }
}

void check_embedding(const Body& body) {
    const Embedding& W = body.W;
    if (W.rows() != body.surface.X.rows() || W.cols() != body.tets.X.rows())
        throw std::invalid_argument(
            fmt::format("embedding is {} x {}; allowed: {} x {}, surface vertices x nodes", W.rows(),
                        W.cols(), body.surface.X.rows(), body.tets.X.rows()));
    const double size = (body.surface.X.colwise().maxCoeff() - body.surface.X.colwise().minCoeff()).norm();
    for (Eigen::Index v = 0; v < W.rows(); ++v) {
        double sum = 0;
        Eigen::RowVector3d x = Eigen::RowVector3d::Zero();
        for (Embedding::InnerIterator it(W, v); it; ++it) {
            sum += it.value();
            x += it.value() * body.tets.X.row(it.col());
        }
        if (!(std::abs(sum - 1) <= 1e-6))
            throw std::invalid_argument(
                fmt::format("weights of surface vertex {} sum to {}; allowed: 1 within 1e-6", v, sum));
        if (const double off = (x - body.surface.X.row(v)).norm(); !(off <= 1e-5 * size))
            throw std::invalid_argument(fmt::format(
                "surface vertex {} lies {:.3g} m away from its embedded position; allowed: {:.3g} m", v, off,
                1e-5 * size));
    }
}

void check_modes(const ModeBasis& modes, Eigen::Index nodes) {
    if (modes.U.cols() == 0 && modes.frequencies.size() == 0) return;
    if (modes.U.rows() != 3 * nodes || modes.U.cols() != modes.frequencies.size())
        throw std::invalid_argument(
            fmt::format("modes are {} x {} with {} frequencies; allowed: {} rows, 3 per node, "
                        "and one frequency per column",
                        modes.U.rows(), modes.U.cols(), modes.frequencies.size(), 3 * nodes));
    check_finite(modes.U, "row of modes");
    for (Eigen::Index i = 0; i < modes.frequencies.size(); ++i) {
        const double f = modes.frequencies[i], last = i > 0 ? modes.frequencies[i - 1] : 0;
        if (!(f >= last) || !std::isfinite(f))
            throw std::invalid_argument(
                fmt::format("frequency {} is {} Hz; allowed: finite, at least {}, ascending", i, f, last));
    }
}

}  // namespace

void check_body(const Body& body) {
    if (!body.origin.allFinite())
        throw std::invalid_argument("the origin is not finite; allowed: finite numbers");
    check_tets(body.tets);
    if (body.surface.X.rows() < 3 || body.surface.F.rows() < 1)
        throw std::invalid_argument(
            fmt::format("surface of {} vertices and {} faces; allowed: at least 3 and 1",
                        body.surface.X.rows(), body.surface.F.rows()));
    check_finite(body.surface.X, "surface vertex");
    check_indices(body.surface.F, body.surface.X.rows(), "face", "vertex");
    check_embedding(body);
    check_material(body.material);
    check_regions(body.regions, body.material, body.tets.T.rows());
    check_modes(body.modes, body.tets.X.rows());
}

}  // namespace nbd
