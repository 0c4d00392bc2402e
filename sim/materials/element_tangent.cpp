#include "sim/materials/element_tangent.hpp"

namespace nbd {
namespace {

LaneMatrix3 product(const LaneMatrix3& A, const LaneMatrix3& B) noexcept {
    LaneMatrix3 C;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) C(i, j) = A(i, 0) * B(0, j) + A(i, 1) * B(1, j) + A(i, 2) * B(2, j);
    return C;
}

LaneMatrix3 transposed(const LaneMatrix3& A) noexcept {
    LaneMatrix3 B;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) B(j, i) = A(i, j);
    return B;
}

/// A vector at each corner.
using Corners = std::array<PrincipalLanes, 4>;

/// Those at corners 1 to 3, as columns, and minus their sum at corner 0.
Corners corners(const LaneMatrix3& columns) noexcept {
    Corners result;
    for (int i = 0; i < 3; ++i) {
        const std::size_t axis = i;
        result[0][axis].setZero();
        for (int a = 0; a < 3; ++a) {
            result[a + 1][axis] = columns(i, a);
            result[0][axis] -= columns(i, a);
        }
    }
    return result;
}

std::size_t pair_index(int a, int b) noexcept { return pair_of_nodes<4>(a, b); }

}  // namespace

ElementTangent::ElementTangent(const PrincipalStretches& stretches, const PrincipalResponse& response,
                               const Lanes& weight) noexcept
    : U(stretches.U), V(stretches.V) {
    for (std::size_t i = 0; i < 3; ++i) {
        A.diagonal[i] = weight * response.A.diagonal[i];
        A.off[i] = weight * response.A.off[i];
        same[i] = 0.5 * weight * (response.flip[i] + response.twist[i]);
        crossed[i] = 0.5 * weight * (response.flip[i] - response.twist[i]);
    }
}

LaneMatrix3 ElementTangent::multiply(const LaneMatrix3& H) const noexcept {
    const LaneMatrix3 local = product(transposed(U), product(H, V));
    LaneMatrix3 P;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const std::size_t at = i, next = j, last = k;
        P(i, i) = A.diagonal[at] * local(i, i) + A.off[last] * local(j, j) + A.off[next] * local(k, k);
        P(j, k) = same[at] * local(j, k) + crossed[at] * local(k, j);
        P(k, j) = same[at] * local(k, j) + crossed[at] * local(j, k);
    }
    return product(U, product(P, transposed(V)));
}

// With q_a = V^T grad N_a, block (a, b) is U M U^T, where M_ii = A_ii q_ai q_bi + sum over j of
// same_ij q_aj q_bj, and M_ij = A_ij q_ai q_bj + crossed_ij q_aj q_bi.
void stiffness_blocks(const ElementTangent& tangent, const LaneMatrix3& gradient,
                      LaneBlocks& blocks) noexcept {
    const auto& [U, V, A, same, crossed] = tangent;
    const Corners corner = corners(product(transposed(V), gradient));
    for (std::size_t a = 0; a < 4; ++a)
        for (std::size_t b = a + 1; b < 4; ++b) {
            const PrincipalLanes &p = corner[a], &r = corner[b];
            LaneMatrix3 M;
            for (int i = 0; i < 3; ++i) {
                const int j = (i + 1) % 3, k = (i + 2) % 3;
                const std::size_t x = i, y = j, z = k;
                M(i, i) = A.diagonal[x] * p[x] * r[x] + same[z] * p[y] * r[y] + same[y] * p[z] * r[z];
                M(j, k) = A.off[x] * p[y] * r[z] + crossed[x] * p[z] * r[y];
                M(k, j) = A.off[x] * p[z] * r[y] + crossed[x] * p[y] * r[z];
            }
            blocks[pair_index(a, b)] = product(U, product(M, transposed(U)));
        }
}

LaneMatrix3 StrainForm::multiply(const LaneMatrix3& H) const noexcept {
    const auto strain = [&](int i, int j) -> Lanes {  // entry of F^T H
        return F(0, i) * H(0, j) + F(1, i) * H(1, j) + F(2, i) * H(2, j);
    };
    const Lanes xx = strain(0, 0), yy = strain(1, 1), zz = strain(2, 2);
    const Lanes pressure = lambda * (xx + yy + zz);
    // The stress: symmetric.
    const Lanes sxx = 2 * mu * xx + pressure, syy = 2 * mu * yy + pressure, szz = 2 * mu * zz + pressure,
                sxy = mu * (strain(0, 1) + strain(1, 0)), sxz = mu * (strain(0, 2) + strain(2, 0)),
                syz = mu * (strain(1, 2) + strain(2, 1));
    LaneMatrix3 P;
    for (int i = 0; i < 3; ++i) {
        P(i, 0) = F(i, 0) * sxx + F(i, 1) * sxy + F(i, 2) * sxz;
        P(i, 1) = F(i, 0) * sxy + F(i, 1) * syy + F(i, 2) * syz;
        P(i, 2) = F(i, 0) * sxz + F(i, 1) * syz + F(i, 2) * szz;
    }
    return P;
}

// With t_a = F grad N_a, block (a, b) is lambda t_a t_b^T + mu t_b t_a^T + mu grad N_a.grad N_b F F^T.
void StrainForm::add_blocks(const LaneMatrix3& gradient, LaneBlocks& blocks) const noexcept {
    const Corners g = corners(gradient), t = corners(product(F, gradient));
    LaneMatrix3 square = product(F, transposed(F));
    for (Lanes& entry : square.entries) entry *= mu;
    for (std::size_t a = 0; a < 4; ++a)
        for (std::size_t b = a + 1; b < 4; ++b) {
            const Lanes along = g[a][0] * g[b][0] + g[a][1] * g[b][1] + g[a][2] * g[b][2];
            LaneMatrix3& block = blocks[pair_index(a, b)];
            for (int i = 0; i < 3; ++i) {
                const std::size_t x = i;
                const Lanes of_a = lambda * t[a][x], of_b = mu * t[b][x];
                for (int j = 0; j < 3; ++j) {
                    const std::size_t y = j;
                    block(i, j) += of_a * t[b][y] + of_b * t[a][y] + along * square(i, j);
                }
            }
        }
}

void store_blocks(const LaneBlocks& from, int count, TetBlocks* to) noexcept {
    for (std::size_t pair = 0; pair < from.size(); ++pair)
        for (int l = 0; l < count; ++l)
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) to[l][pair](i, j) = static_cast<float>(from[pair](i, j)[l]);
}

}  // namespace nbd
