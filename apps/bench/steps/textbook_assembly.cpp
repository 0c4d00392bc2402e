#include "apps/bench/steps/textbook_assembly.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>

namespace nbd {
namespace {

Eigen::Matrix3d edges(const Nodes& x, const Tets& T, Eigen::Index t) {
    Eigen::Matrix3d D;
    for (int a = 0; a < 3; ++a) D.col(a) = (x.row(T(t, a + 1)) - x.row(T(t, 0))).transpose();
    return D;
}

Eigen::Matrix3d rotation(const Eigen::Matrix3d& F) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d U = svd.matrixU();
    if (U.determinant() * svd.matrixV().determinant() < 0) U.col(2) = -U.col(2);
    return U * svd.matrixV().transpose();
}

}  // namespace

TextbookAssembly::TextbookAssembly(const ElasticBody& body) : body_(body), mass_(body.mass_matrix()) {
    const TetMesh& rest = body.rest();
    for (int t = 0; t < body.element_count(); ++t) {
        const auto& [law, mu, lambda] = body.moduli(t);  // corotated, as textbooks have it, whatever the law
        inverse_edges_.push_back(edges(rest.X, rest.T, t).inverse());
        Eigen::Matrix<double, 3, 4> g;
        g.rightCols<3>() = inverse_edges_.back().transpose();
        g.col(0) = -g.rightCols<3>().rowwise().sum();
        Eigen::Matrix<double, 12, 12> K;
        for (int a = 0; a < 4; ++a)
            for (int b = 0; b < 4; ++b)
                K.block<3, 3>(3 * a, 3 * b) =
                    body.rest_volumes()[t] *
                    (lambda * g.col(a) * g.col(b).transpose() + mu * g.col(b) * g.col(a).transpose() +
                     mu * g.col(a).dot(g.col(b)) * Eigen::Matrix3d::Identity());
        stiffness_.push_back(K);
    }
}

void TextbookAssembly::assemble(const Nodes& x, double mass_scale, double stiffness_scale, Nodes& force,
                                SparseMatrix& A) {
    const Tets& T = body_.rest().T;
    const BlockPattern& pattern = body_.pattern();
    A = mass_scale * mass_;
    force.setZero(x.rows(), 3);
    for (Eigen::Index t = 0; t < T.rows(); ++t) {
        const Eigen::Matrix3d R = rotation(edges(x, T, t) * inverse_edges_[t]);
        Eigen::Matrix<double, 12, 12> turn = Eigen::Matrix<double, 12, 12>::Zero();
        Eigen::Matrix<double, 12, 1> displacement;
        for (int a = 0; a < 4; ++a) {
            turn.block<3, 3>(3 * a, 3 * a) = R;
            displacement.segment<3>(3 * a) =
                R.transpose() * x.row(T(t, a)).transpose() - body_.rest().X.row(T(t, a)).transpose();
        }
        const Eigen::Matrix<double, 12, 12> RK = turn * stiffness_[t];
        const Eigen::Matrix<double, 12, 12> K = RK * turn.transpose();
        const Eigen::Matrix<double, 12, 1> f = -RK * displacement;
        for (int a = 0; a < 4; ++a) {
            force.row(T(t, a)) += f.segment<3>(3 * a).transpose();
            for (int b = 0; b < 4; ++b) {
                const int i = T(t, a), k = pattern.find(i, T(t, b)) - pattern.first_block(i);
                pattern.block(A, i, k) += stiffness_scale * K.block<3, 3>(3 * b, 3 * a);
            }
        }
    }
}

}  // namespace nbd
