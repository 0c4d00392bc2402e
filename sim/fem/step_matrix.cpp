#include "sim/fem/step_matrix.hpp"

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {

Eigen::Matrix3d StepMatrix::block(int i, int k) const noexcept {
    if (pattern_->neighbours(i)[k] == i) return diagonal_[i];
    return blocks_.block(i, k).cast<double>();
}

void StepMatrix::balance_rows(const Eigen::VectorXd& sums) {
    parallel_for(node_count(), [&](int i) {
        Eigen::Matrix3d others = Eigen::Matrix3d::Zero();
        blocks_.for_each(i, [&](int, const auto& block) { others += block.template cast<double>(); });
        diagonal_[i] = sums[i] * Eigen::Matrix3d::Identity() - 0.5 * (others + others.transpose());
    });
}

void StepMatrix::isolate(int i) {
    const auto row = pattern_->neighbours(i);
    for (int k = 0; k < std::ssize(row); ++k) {
        const int j = row[k];
        if (j == i) continue;
        set(i, k, Eigen::Matrix3f::Zero());
        set(j, pattern_->find(j, i) - pattern_->first_block(j), Eigen::Matrix3f::Zero());
    }
    diagonal_[i].setIdentity();
}

Eigen::Vector3d StepMatrix::multiply_row(int i, const double* v) const noexcept {
    using At = Eigen::Map<const Eigen::Vector3d>;
    Eigen::Vector3d sum = diagonal_[i] * At(v + 3 * i);
    blocks_.for_each(i,
                     [&](int j, const auto& block) { sum += block.template cast<double>() * At(v + 3 * j); });
    return sum;
}

}  // namespace nbd
