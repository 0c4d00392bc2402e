#include "apps/bench/elements/clamped_body.hpp"

#include <utility>

#include "apps/bench/elements/element_stiffness.hpp"

namespace nbd {

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
