#include "sim/fem/quadratic_points.hpp"

#include <array>
#include <utility>

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

void move_to_points(LaneMatrix3& of_corners) noexcept {
    static_assert(lanes % 4 == 0);
    for (Lanes& entry : of_corners.entries)
        for (int first = 0; first < lanes; first += 4) {
            auto four = entry.segment<4>(first);
            four = (QuadraticRule::own_corner * four + QuadraticRule::far_corners * four.sum()).eval();
        }
}

// The gradient of node a's shape function is z_a g_a, and that of edge ab's z_a g_b + z_b g_a, where g are
// gradients in the corner tetrahedra and z coordinates. So a block of the quadratic tetrahedron is a sum of
// moments[c][d] (a, b): the sums over points of z_c z_d times the block (a, b) there.
QuadraticTetBlocks stiffness_of_points(std::span<const TetBlocks, 4> of_points) noexcept {
    constexpr float own = QuadraticRule::own_corner, far = QuadraticRule::far_corners;
    std::array<AllBlocks, 4> at;
    for (std::size_t p = 0; p < 4; ++p) at[p] = all_of(of_points[p]);
    const AllBlocks sum = far * far * (at[0] + at[1] + at[2] + at[3]);
    std::array<std::array<AllBlocks, 4>, 4> moments;
    for (std::size_t c = 0; c < 4; ++c)
        for (std::size_t d = c; d < 4; ++d) {
            moments[c][d] = sum + own * far * (at[c] + at[d]);
            if (c == d)
                moments[c][c] += own * own * at[c];
            else
                moments[d][c] = moments[c][d];
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
