#include "collision/nbd_tree/bd_bound.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"

namespace nbd {
namespace {

/// Returns (Uhat^T what Uhat)^-1. The modes are first scaled to unit length, so that the test for linear
/// dependence does not depend on their units.
Eigen::MatrixXf fit_matrix(const ClusteredModes& modes) {
    Eigen::MatrixXd U = modes.U.numbers().cast<double>();
    for (Eigen::Index i = 0; i < modes.w.size(); ++i) U.middleRows<3>(3 * i) *= std::sqrt(modes.w[i]);
    const Eigen::MatrixXd gram = U.transpose() * U;
    for (Eigen::Index j = 0; j < gram.cols(); ++j)
        if (!(gram(j, j) > 0))
            throw std::invalid_argument(message("BD-Tree: mode ", j, " is zero at all representatives"));
    const Eigen::VectorXd scale = gram.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd unit_gram = scale.asDiagonal() * gram * scale.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(unit_gram);
    const double smallest = eigen.eigenvalues()[0], largest = eigen.eigenvalues().tail<1>()[0];
    if (eigen.info() != Eigen::Success || smallest < 1e-8 * largest)
        throw std::invalid_argument(
            message("BD-Tree: the modes are linearly dependent at the representatives (", modes.U.cols(),
                    " modes, ", modes.representatives.size(),
                    " representatives; squared singular values from ", smallest, " to ", largest, ")"));
    const Eigen::MatrixXd inverse = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                                    eigen.eigenvectors().transpose();
    return (scale.asDiagonal() * inverse * scale.asDiagonal()).cast<float>();
}

}  // namespace

BdModel build_bd_model(const SphereTree& tree, Eigen::Ref<const Eigen::MatrixXf> U, ClusteredModes modes) {
    for (const int v : tree.vertices)
        if (3 * (Eigen::Index{v} + 1) > U.rows())
            throw std::invalid_argument(message("BD-Tree: U has ", U.rows(), " rows, the tree's vertex ", v,
                                                " needs ", 3 * (Eigen::Index{v} + 1)));
    if (U.rows() % 3 != 0)
        throw std::invalid_argument(message("BD-Tree: U has ", U.rows(), " rows, allowed: 3 per vertex"));
    check_clustered_modes(modes, static_cast<int>(U.rows() / 3));
    if (modes.U.cols() != U.cols())
        throw std::invalid_argument(
            message("BD-Tree: U has ", U.cols(), " modes, the clustered modes have ", modes.U.cols()));
    if (!U.allFinite()) throw std::invalid_argument("BD-Tree: an entry of U is not finite");

    BdModel model;
    model.z_to_q = fit_matrix(modes);
    const Eigen::Index nodes = tree.nodes.size();
    model.Ubar.resize(U.cols(), 3 * nodes);
    model.dr.resize(U.cols(), nodes);
    for (Eigen::Index i = 0; i < nodes; ++i) {
        const std::span<const int> vertices = tree.node_vertices(i);
        for (Eigen::Index j = 0; j < U.cols(); ++j) {
            Eigen::Vector3d sum = Eigen::Vector3d::Zero();
            for (const int v : vertices) sum += U.col(j).segment<3>(3 * Eigen::Index{v}).cast<double>();
            const Eigen::Vector3f mean = (sum / static_cast<double>(vertices.size())).cast<float>();
            float squared = 0;
            for (const int v : vertices)
                squared = std::max(squared, (U.col(j).segment<3>(3 * Eigen::Index{v}) - mean).squaredNorm());
            model.Ubar.row(j).segment<3>(3 * i) = mean.transpose();
            model.dr(j, i) = std::sqrt(squared) * (1 + 4 * std::numeric_limits<float>::epsilon());
        }
    }
    model.modes = std::move(modes);
    return model;
}

void check_bd_model(const BdModel& model, const SphereTree& tree, int vertex_count) {
    check_clustered_modes(model.modes, vertex_count);
    const Eigen::Index m = model.modes.U.cols();
    const Eigen::Index nodes = tree.nodes.size();
    const auto check_shape = [](const char* what, const Eigen::MatrixXf& a, Eigen::Index rows,
                                Eigen::Index cols) {
        if (a.rows() != rows || a.cols() != cols)
            throw std::invalid_argument(message("BD-Tree: ", what, " is ", a.rows(), " x ", a.cols(),
                                                " instead of ", rows, " x ", cols));
        if (!a.allFinite())
            throw std::invalid_argument(message("BD-Tree: an entry of ", what, " is not finite"));
    };
    check_shape("z_to_q", model.z_to_q, m, m);
    check_shape("Ubar", model.Ubar, m, 3 * nodes);
    check_shape("dr", model.dr, m, nodes);
    if (model.dr.size() > 0 && model.dr.minCoeff() < 0)
        throw std::invalid_argument("BD-Tree: an entry of dr is negative");
}

BdBound::BdBound(const SphereTree& tree, const BdModel& model)
    : tree_(&tree), model_(&model), z_(Eigen::VectorXf::Zero(model.modes.U.cols())), q_(z_), abs_q_(z_) {
    scratch_.fit(model.modes.X.rows());
}

void BdBound::begin_pose(VerticesRef x) noexcept {
    align_ = modal_coordinates(model_->modes, x, scratch_, z_);
    q_.noalias() = model_->z_to_q * z_;
    abs_q_ = q_.cwiseAbs();
}

Sphere BdBound::bound(int node) const noexcept {
    const Eigen::Index column = 3 * Eigen::Index{node};
    const Sphere& rest = tree_->rest[node];
    const Eigen::Vector3f shift(model_->Ubar.col(column).dot(q_), model_->Ubar.col(column + 1).dot(q_),
                                model_->Ubar.col(column + 2).dot(q_));
    return to_world(align_, {rest.c + shift, rest.r + model_->dr.col(node).dot(abs_q_)});
}

}  // namespace nbd
