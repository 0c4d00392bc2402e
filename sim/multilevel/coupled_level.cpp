#include "sim/multilevel/coupled_level.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cstddef>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

constexpr int degree = 3;    // of the polynomial
constexpr float range = 20;  // it damps eigenvalues from bound / range to bound

template <int B>
using Part = Eigen::Map<Eigen::Matrix<float, B, 1>>;
template <int B>
using ConstPart = Eigen::Map<const Eigen::Matrix<float, B, 1>>;

}  // namespace

template <int B>
void CoupledLevel<B>::begin(std::vector<const FloatBlocks<B, B>*> matrices, Diagonal diagonal,
                            std::vector<Square> inverses, float bound) {
    matrices_ = std::move(matrices);
    diagonal_ = std::move(diagonal);
    inverses_ = std::move(inverses);
    bound_ = bound;
    touched_.clear();
    untouched_.clear();
    acting_.clear();
    couplings_ = {};
    first_.assign(1, 0);
    for (const FloatBlocks<B, B>* A : matrices_) first_.push_back(first_.back() + A->rows());
    place_.assign(static_cast<std::size_t>(rows()), -1);
    for (std::vector<float>* vector : {&z, &residual, &direction})
        vector->resize(static_cast<std::size_t>(B * rows()));
}

template <int B>
std::size_t CoupledLevel<B>::body_of(int row) const noexcept {
    return static_cast<std::size_t>(std::ranges::upper_bound(first_, row) - first_.begin()) - 1;
}

template <int B>
void CoupledLevel<B>::forget_acting() {
    for (std::size_t k = 0; k < touched_.size(); ++k) {
        inverses_[static_cast<std::size_t>(touched_[k])] = untouched_[k];
        place_[static_cast<std::size_t>(touched_[k])] = -1;
    }
    touched_.clear();
    untouched_.clear();
    acting_.clear();
}

template <int B>
void CoupledLevel<B>::begin_couplings(LevelCouplings<B> couplings) {
    forget_acting();
    couplings_ = std::move(couplings);
}

/// D of a coupling is not the diagonal of J^T A J but larger, so that the eigenvalues of D^-1 J^T A J do not
/// exceed those of the bodies: |sum of J_i v_i|^2 <= sum of |J_i v_i|^2 / s_i for shares s_i that sum to one.
template <int B>
void CoupledLevel<B>::set_acting(std::span<const ActingCoupling> acting) {
    forget_acting();
    acting_.assign(acting.begin(), acting.end());
    Diagonal added;
    for (const ActingCoupling& coupling : acting_) {
        const auto terms = couplings_.of(coupling.index);
        float total = 0;
        for (const auto& [row, J] : terms) total += J.norm();
        for (const auto& [row, J] : terms) {
            const float norm = J.norm();
            if (norm == 0) continue;
            int& at = place_[static_cast<std::size_t>(row)];
            if (at < 0) {
                at = static_cast<int>(touched_.size());
                touched_.push_back(row);
                untouched_.push_back(inverses_[static_cast<std::size_t>(row)]);
                added.push_back(diagonal_[static_cast<std::size_t>(row)]);
            }
            const Eigen::Matrix<float, 3, B> AJ = coupling.A * J;
            const Square block = (total / norm / bound_) * (J.transpose() * AJ);
            added[static_cast<std::size_t>(at)] += block.template cast<double>();
        }
    }
    parallel_for(
        static_cast<int>(touched_.size()),
        [&](int k) {
            const auto at = static_cast<std::size_t>(k);
            inverses_[static_cast<std::size_t>(touched_[at])] = added[at].inverse().template cast<float>();
        },
        64);
}

template <int B>
void CoupledLevel<B>::subtract_product(const float* from, float* to) const {
    for (std::size_t b = 0; b < matrices_.size(); ++b) {
        const float* from_body = from + B * first_[b];
        float* to_body = to + B * first_[b];
        parallel_for(matrices_[b]->rows(), [&](int i) {
            const auto row = matrices_[b]->times(i, from_body);
            for (int c = 0; c < B; ++c) to_body[B * i + c] -= row[c];
        });
    }
    for (const ActingCoupling& coupling : acting_) {
        const auto terms = couplings_.of(coupling.index);
        Eigen::Vector3f u = Eigen::Vector3f::Zero();
        for (const auto& [row, J] : terms) u += J * ConstPart<B>(from + B * row);
        const Eigen::Vector3f impulse = coupling.A * u;
        for (const auto& [row, J] : terms) Part<B>(to + B * row) -= J.transpose() * impulse;
    }
}

/// direction = old_share direction + new_share D^-1 residual; z += direction.
template <int B>
void CoupledLevel<B>::step(float old_share, float new_share) {
    parallel_for(rows(), [&](int i) {
        Part<B> d(direction.data() + B * i);
        d = old_share * d +
            new_share * (inverses_[static_cast<std::size_t>(i)] * ConstPart<B>(residual.data() + B * i));
        Part<B>(z.data() + B * i) += d;
    });
}

/// Adds a polynomial in D^-1 A times D^-1 residual to z. `residual` does not contain the last step.
template <int B>
void CoupledLevel<B>::smooth() {
    const float middle = bound_ * (1 + 1 / range) / 2, radius = bound_ * (1 - 1 / range) / 2;
    float rho = radius / middle;
    step(0, 1 / middle);
    for (int k = 1; k < degree; ++k) {
        subtract_product(direction.data(), residual.data());
        const float next = 1 / (2 * middle / radius - rho);
        step(next * rho, 2 * next / radius);
        rho = next;
    }
}

template <int B>
void CoupledLevel<B>::smooth_from_zero() {
    std::ranges::fill(z, 0.F);
    std::ranges::fill(direction, 0.F);
    smooth();
    subtract_product(direction.data(), residual.data());
}

template <int B>
void CoupledLevel<B>::correct_and_smooth() {
    parallel_for(rows(), [&](int i) { Part<B>(z.data() + B * i) += ConstPart<B>(direction.data() + B * i); });
    subtract_product(direction.data(), residual.data());
    smooth();
}

template class CoupledLevel<3>;
template class CoupledLevel<6>;

}  // namespace nbd
