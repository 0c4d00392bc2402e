#include "apps/bench/elements/clamped_body.hpp"

#include <Eigen/LU>
#include <utility>

namespace nbd {
namespace {

using CornerGradients = Eigen::Matrix<double, 3, 4>;  // of the barycentric coordinates, 1/m

/// Gradients of the shape functions where the barycentric coordinates are z.
template <int N>
Eigen::Matrix<double, 3, N> shape_gradients(const CornerGradients& g, const Eigen::Vector4d& z) {
    if constexpr (N == 4) {
        return g;
    } else {
        Eigen::Matrix<double, 3, N> G;
        G.template leftCols<4>() = g * (4 * z.array() - 1).matrix().asDiagonal();
        int k = 4;
        for (int a = 0; a < 4; ++a)
            for (int b = a + 1; b < 4; ++b) G.col(k++) = 4 * (z[a] * g.col(b) + z[b] * g.col(a));
        return G;
    }
}

}  // namespace

template <int N>
ElementIntegrals<N> integrate_element(const Eigen::Matrix<double, 3, 4>& corners, const Moduli& moduli) {
    constexpr int points = N == 4 ? 1 : 4;
    constexpr double off = points == 1 ? 0.25 : 0.13819660112501052;  // (5 - sqrt 5) / 20
    const Eigen::Matrix3d edges = corners.rightCols<3>().colwise() - corners.col(0);
    const double volume = edges.determinant() / 6;
    CornerGradients g;
    g.rightCols<3>() = edges.inverse().transpose();
    g.col(0) = -g.rightCols<3>().rowwise().sum();

    // Integrals of products of derivatives, of which the law makes the blocks.
    Eigen::Matrix<double, 3 * N, 3 * N> products = Eigen::Matrix<double, 3 * N, 3 * N>::Zero();
    for (int p = 0; p < points; ++p) {
        Eigen::Vector4d z = Eigen::Vector4d::Constant(off);
        z[p] = 1 - 3 * off;
        const Eigen::Matrix<double, 3, N> G = shape_gradients<N>(g, z);
        const Eigen::Map<const Eigen::Matrix<double, 3 * N, 1>> derivatives(G.data());
        products.noalias() += (volume / points) * derivatives * derivatives.transpose();
    }
    ElementIntegrals<N> result;
    for (int a = 0; a < N; ++a)
        for (int b = 0; b < N; ++b) {
            const Eigen::Matrix3d D = products.template block<3, 3>(3 * a, 3 * b);
            result.stiffness.template block<3, 3>(3 * a, 3 * b) =
                moduli.lambda * D + moduli.mu * (D.transpose() + D.trace() * Eigen::Matrix3d::Identity());
        }
    if constexpr (N == 4)
        result.shapes.setConstant(volume / 4);
    else
        result.shapes << Eigen::Vector4d::Constant(-volume / 20),
            Eigen::Matrix<double, 6, 1>::Constant(volume / 5);
    return result;
}

template ElementIntegrals<4> integrate_element<4>(const Eigen::Matrix<double, 3, 4>&, const Moduli&);
template ElementIntegrals<10> integrate_element<10>(const Eigen::Matrix<double, 3, 4>&, const Moduli&);

template <int N>
ClampedBody<N>::ClampedBody(const Nodes& X, const Elements<N>& T, int held)
    : X_(X), T_(T), held_(held), row_(X.rows(), 0) {
    for (const int node : T.topRows(held).reshaped()) row_[node] = -1;
    int moving = 0;
    for (int& row : row_)
        if (row == 0) row = moving++;
    std::vector<std::vector<int>> neighbours(moving);
    for (Eigen::Index t = held; t < T.rows(); ++t)
        for (const int a : T.row(t))
            for (const int b : T.row(t))
                if (const int i = row_[a], j = row_[b]; i >= 0 && j >= 0) neighbours[i].push_back(j);
    pattern_ = BlockPattern(std::move(neighbours));
}

template <int N>
void ClampedBody<N>::assemble(const Moduli& moduli, const Eigen::Vector3d& force, SparseMatrix& K,
                              Eigen::VectorXd& f) const {
    K.coeffs().setZero();
    f.setZero(unknown_count());
    for (Eigen::Index t = held_; t < T_.rows(); ++t) {
        const Eigen::Matrix<double, 3, 4> corners = X_(T_.row(t).template head<4>(), Eigen::all).transpose();
        const ElementIntegrals<N> element = integrate_element<N>(corners, moduli);
        for (int a = 0; a < N; ++a) {
            const int i = row_[T_(t, a)];
            if (i < 0) continue;
            f.segment<3>(3 * i) += element.shapes[a] * force;
            for (int b = 0; b < N; ++b) {
                const int j = row_[T_(t, b)];
                if (j < 0) continue;
                pattern_.block(K, i, pattern_.find(i, j) - pattern_.first_block(i)) +=
                    element.stiffness.template block<3, 3>(3 * b, 3 * a);
            }
        }
    }
}

template <int N>
Nodes ClampedBody<N>::of_nodes(const Eigen::VectorXd& u) const {
    Nodes result = Nodes::Zero(X_.rows(), 3);
    for (std::size_t i = 0; i < row_.size(); ++i)
        if (row_[i] >= 0) result.row(i) = u.segment<3>(3 * row_[i]).transpose();
    return result;
}

template class ClampedBody<4>;
template class ClampedBody<10>;

}  // namespace nbd
