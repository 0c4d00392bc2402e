#include "sim/fem/quadratic_points.hpp"

#include <Eigen/Eigenvalues>
#include <array>
#include <utility>

#include "meshing/surface/material_fill.hpp"
#include "meshing/surface/quadratic_tets.hpp"

namespace nbd {
namespace {

/// The blocks (a, b) of a linear tetrahedron, one after the other: 4 a + b.
using AllBlocks = Eigen::Array<float, 16 * 9, 1>;

Eigen::Map<const Eigen::Matrix3f> block(const AllBlocks& all, int a, int b) noexcept {
    return Eigen::Map<const Eigen::Matrix3f>(all.data() + static_cast<std::ptrdiff_t>(9 * (4 * a + b)));
}

/// Its rows sum to zero, as moving all nodes alike costs no force.
AllBlocks all_of(const TetBlocks& blocks) noexcept {
    AllBlocks all;
    const auto at = [&](int a, int b) {
        return Eigen::Map<Eigen::Matrix3f>(all.data() + static_cast<std::ptrdiff_t>(9 * (4 * a + b)));
    };
    for (int a = 0; a < 4; ++a) at(a, a).setZero();
    for (int a = 0; a < 4; ++a)
        for (int b = a + 1; b < 4; ++b) {
            const Eigen::Matrix3f& one = blocks[pair_of_nodes<4>(a, b)];
            at(a, b) = one;
            at(b, a) = one.transpose();
            at(a, a) -= one;
            at(b, b) -= one.transpose();
        }
    return all;
}

}  // namespace

// With the means S of the products of coordinates z z^T, points P of equal weight need P^T P = 4 S and rows
// that sum to 1. P = 2 Q S^(1/2) has the former for every rotation Q. The one that turns the row sums of
// 2 S^(1/2), of norm 2, into ones by the shortest way leaves the points of a full tetrahedron as they are.
TetPoints points_of_fill(const Eigen::Matrix<double, 1, 10>& fill) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> axes(coordinate_products(fill) / fill.sum());
    const Eigen::Matrix4d root = 2 * axes.eigenvectors() *
                                 axes.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() *
                                 axes.eigenvectors().transpose();
    const Eigen::Vector4d from = root.rowwise().sum() / 2, to = Eigen::Vector4d::Constant(0.5),
                          middle = from + to;  // never zero: from . to > 0
    const Eigen::Matrix4d turn = Eigen::Matrix4d::Identity() -
                                 middle * middle.transpose() / (1 + from.dot(to)) + 2 * to * from.transpose();
    return turn * root;
}

// That of two quadratic Bernstein polynomials with the exponents a and b, each of sum 2, is 1 / 210 times the
// product over corners of (a + b)! / (a! b!).
ShapeProducts products_in_full_tet() {
    ShapeProducts means;
    const auto exponent = [](int node, int corner) {
        if (node < 4) return node == corner ? 2 : 0;
        const auto [a, b] = edges_of_tet[node - 4];
        return a == corner || b == corner ? 1 : 0;
    };
    constexpr std::array<int, 5> factorial{1, 1, 2, 6, 24};
    for (int i = 0; i < 10; ++i)
        for (int j = 0; j < 10; ++j) {
            means(i, j) = 1.0 / 210;
            for (int corner = 0; corner < 4; ++corner) {
                const int a = exponent(i, corner), b = exponent(j, corner);
                means(i, j) *= factorial[a + b] / (factorial[a] * factorial[b]);
            }
        }
    return means;
}

ShapeProducts products_at(const TetPoints& points) {
    Eigen::Matrix<double, 10, 4> functions;
    for (int a = 0; a < 4; ++a) functions.row(a) = points.col(a).cwiseAbs2().transpose();
    for (int k = 0; k < 6; ++k) {
        const auto [a, b] = edges_of_tet[k];
        functions.row(4 + k) = 2 * points.col(a).cwiseProduct(points.col(b)).transpose();
    }
    return functions * functions.transpose() / 4;
}

void mix_lanes(const std::array<const TetPoints*, lanes / 4>& points, LaneMatrix3& matrices) noexcept {
    for (Lanes& entry : matrices.entries)
        for (std::size_t i = 0; i < points.size(); ++i) {
            auto four = entry.segment<4>(4 * i).matrix();
            four = (*points[i] * four).eval();
        }
}

void mix_lanes_transposed(const std::array<const TetPoints*, lanes / 4>& points,
                          LaneMatrix3& matrices) noexcept {
    for (Lanes& entry : matrices.entries)
        for (std::size_t i = 0; i < points.size(); ++i) {
            auto four = entry.segment<4>(4 * i).matrix();
            four = (points[i]->transpose() * four).eval();
        }
}

// The gradient of node a's shape function is z_a g_a, and that of edge ab's z_a g_b + z_b g_a, where g are
// gradients in the corner tetrahedra and z coordinates. So a block of the quadratic tetrahedron is a sum of
// moments[c][d] (a, b): the sums over points of z_c z_d times the block (a, b) there.
QuadraticTetBlocks stiffness_of_points(const TetPoints& points,
                                       std::span<const TetBlocks, 4> of_points) noexcept {
    const Eigen::Matrix4f z = points.cast<float>();
    std::array<AllBlocks, 4> at;
    for (std::size_t p = 0; p < 4; ++p) at[p] = all_of(of_points[p]);
    std::array<std::array<AllBlocks, 4>, 4> moments;
    for (int c = 0; c < 4; ++c)
        for (int d = c; d < 4; ++d) {
            const Eigen::Array4f w = z.col(c).array() * z.col(d).array();
            moments[c][d] = w[0] * at[0] + w[1] * at[1] + w[2] * at[2] + w[3] * at[3];
            if (c != d) moments[d][c] = moments[c][d];
        }
    // Coordinate and gradient of each product in a shape function's gradient.
    const auto products = [](int node) -> std::array<std::pair<int, int>, 2> {
        if (node < 4) return {{{node, node}, {node, node}}};
        const auto [a, b] = edges_of_tet[node - 4];
        return {{{a, b}, {b, a}}};
    };
    QuadraticTetBlocks blocks;
    for (int i = 0; i < 10; ++i)
        for (int j = i + 1; j < 10; ++j) {
            const auto of_i = products(i), of_j = products(j);
            Eigen::Matrix3f total = Eigen::Matrix3f::Zero();
            for (int k = 0; k < (i < 4 ? 1 : 2); ++k)
                for (int l = 0; l < (j < 4 ? 1 : 2); ++l)
                    total += block(moments[of_i[k].first][of_j[l].first], of_i[k].second, of_j[l].second);
            blocks[pair_of_nodes<10>(i, j)] = total;
        }
    return blocks;
}

}  // namespace nbd
