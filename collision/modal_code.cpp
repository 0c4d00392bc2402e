#include "collision/modal_code.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <stdexcept>

#include "collision/message.hpp"

namespace nbd {

RigidTransform match_shape(VerticesRef X, VerticesRef x, Eigen::Ref<const Eigen::VectorXf> w) noexcept {
    // Moments about the first point: no digits are lost far from the origin, and one pass is enough.
    const Eigen::Vector3d X0 = X.row(0).transpose().cast<double>(), x0 = x.row(0).transpose().cast<double>();
    double total = 0;
    Eigen::Vector3d sum_X = Eigen::Vector3d::Zero(), sum_x = sum_X;
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    for (Eigen::Index i = 0; i < X.rows(); ++i) {
        const Eigen::Vector3d weighted_X = w[i] * (X.row(i).transpose().cast<double>() - X0);
        const Eigen::Vector3d moved = x.row(i).transpose().cast<double>() - x0;
        total += w[i];
        sum_X += weighted_X;
        sum_x += w[i] * moved;
        A += moved * weighted_X.transpose();
    }
    A -= sum_x * sum_X.transpose() / total;
    // Points on a line or all in one place leave R open; this picks the R nearest to the identity, and is
    // far below float precision for all others.
    A.diagonal().array() += 1e-10 * A.norm();

    RigidTransform align;
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    if (svd.info() == Eigen::Success) {
        const bool reflected = svd.matrixU().determinant() * svd.matrixV().determinant() < 0;
        const Eigen::Vector3d signs(1, 1, reflected ? -1 : 1);
        R = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
    }
    align.R = R.cast<float>();
    align.t = (x0 + sum_x / total - R * (X0 + sum_X / total)).cast<float>();
    return align;
}

RigidTransform modal_code(const ClusteredModes& modes, VerticesRef x, ModalCodeScratch& scratch,
                          Eigen::Ref<Eigen::VectorXf> z) noexcept {
    const Eigen::Index k = modes.X.rows();
    scratch.x.resize(k, 3);
    scratch.d.resize(3 * k);
    for (Eigen::Index i = 0; i < k; ++i)
        scratch.x.row(i) = x.row(modes.representatives[static_cast<std::size_t>(i)]);
    const RigidTransform align = match_shape(modes.X, scratch.x, modes.w);
    for (Eigen::Index i = 0; i < k; ++i) {
        const Eigen::Vector3f y = align.R.transpose() * (scratch.x.row(i).transpose() - align.t);
        scratch.d.segment<3>(3 * i) = modes.w[i] * (y - modes.X.row(i).transpose());
    }
    z.noalias() = modes.U.transpose() * scratch.d;
    return align;
}

void check_clustered_modes(const ClusteredModes& modes, int vertex_count) {
    const auto k = static_cast<Eigen::Index>(modes.representatives.size());
    if (k == 0) throw std::invalid_argument("modes: no representative vertices");
    for (const int v : modes.representatives)
        if (v < 0 || v >= vertex_count)
            throw std::invalid_argument(message("modes: representative vertex ", v, ", but the surface has ",
                                                vertex_count, " vertices"));
    if (modes.w.size() != k || modes.X.rows() != k || modes.U.rows() != 3 * k)
        throw std::invalid_argument(message("modes: ", k, " representatives, but ", modes.w.size(),
                                            " weights, ", modes.X.rows(), " rest positions and ",
                                            modes.U.rows(), " rows of U instead of ", 3 * k));
    if (modes.U.cols() == 0) throw std::invalid_argument("modes: U has no columns");
    if (!modes.X.allFinite() || !modes.U.allFinite())
        throw std::invalid_argument("modes: a rest position or an entry of U is not finite");
    for (Eigen::Index i = 0; i < k; ++i)
        if (!(modes.w[i] > 0 && std::isfinite(modes.w[i])))
            throw std::invalid_argument(
                message("modes: weight ", i, " is ", modes.w[i], ", allowed: finite and above 0"));
}

}  // namespace nbd
