#include "apps/bench/elements/element_stiffness.hpp"

#include <Eigen/LU>

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

}  // namespace nbd
