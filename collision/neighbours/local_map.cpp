#include "collision/neighbours/local_map.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace nbd {
namespace {

/// Covers the rounding of eigenvalues and of an inverse, relative to their largest numbers.
constexpr double slack = 1e-6;

}  // namespace

LocalPoints local_points(const Nodes& x, std::span<const int> vertices, const Eigen::Vector3d& centre,
                         double size) {
    LocalPoints points(3, vertices.size());
    for (Eigen::Index i = 0; i < points.cols(); ++i) points.col(i) = x.row(vertices[i]).transpose();
    points.colwise() -= centre;
    points *= 1 / size;
    return points;
}

LocalPoints local_points(std::span<const float> numbers) {
    using Numbers = Eigen::Matrix<float, 3, Eigen::Dynamic, Eigen::RowMajor>;
    return Eigen::Map<const Numbers>(numbers.data(), 3, static_cast<Eigen::Index>(numbers.size() / 3))
        .cast<double>();
}

TermMatrix terms(const LocalPoints& Z) {
    TermMatrix T(10, Z.cols());
    T.row(0).setOnes();
    T.middleRows<3>(1) = Z;
    for (int k = 0; k < 3; ++k) {
        T.row(4 + k) = Z.row(k).cwiseAbs2();
        T.row(7 + k) = Z.row((k + 1) % 3).cwiseProduct(Z.row((k + 2) % 3));
    }
    return T;
}

/// For a quadratic map, q(x) - q(y) is the gradient in the middle m of x and y times x - y. This gradient is
/// (I + K(m)) A with K linear in m. Along d, the direction of A (x - y), the difference is at least
/// |A (x - y)| (1 + d.K d), and d.K d = d.sym(K) d >= -|sym K|, which is largest in a corner of the box.
MapBound bound_of(const LocalMap& q, const Eigen::Vector3d& half) {
    const Eigen::Matrix3d A = q.middleCols<3>(1);
    // H[k]: derivative of the gradient with respect to z_k.
    std::array<Eigen::Matrix3d, 3> H;
    H[0] << 2 * q.col(4), q.col(9), q.col(8);
    H[1] << q.col(9), 2 * q.col(5), q.col(7);
    H[2] << q.col(8), q.col(7), 2 * q.col(6);
    double squares = 0;
    for (const Eigen::Matrix3d& h : H) squares += h.squaredNorm();

    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(A.transpose() * A, Eigen::EigenvaluesOnly);
    const double least = solver.eigenvalues()[0] - slack * solver.eigenvalues()[2];
    if (!(least > 0)) return {0, std::sqrt(squares)};

    const Eigen::Matrix3d inverse = A.inverse();
    std::array<Eigen::Matrix3d, 3> K;
    for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Matrix3d turned = H[k] * inverse * half[k];
        K[k] = 0.5 * (turned + turned.transpose());
    }
    double largest = 0;
    for (const double s : {-1.0, 1.0})
        for (const double t : {-1.0, 1.0})
            largest = std::max(largest, (K[0] + s * K[1] + t * K[2]).squaredNorm());
    return {std::sqrt(least) * (1 - slack - std::sqrt(largest)), std::sqrt(squares)};
}

}  // namespace nbd
