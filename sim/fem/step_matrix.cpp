#include "sim/fem/step_matrix.hpp"

#include <utility>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {

Eigen::Matrix3d StepMatrix::block(int i, int k) const noexcept {
    if (pattern_->neighbours(i)[k] == i) return diagonal_[i];
    if (!exact_.empty()) return exact_[pattern_->first_block(i) + k];
    return blocks_.block(i, k).cast<double>();
}

template <class Visit>
void StepMatrix::for_each_beside(int i, const Visit& visit) const {
    if (exact_.empty()) {
        blocks_.for_each(i, [&](int j, const auto& block) { visit(j, block.template cast<double>()); });
        return;
    }
    const auto row = pattern_->neighbours(i);
    for (int k = 0; k < std::ssize(row); ++k)
        if (row[k] != i) visit(row[k], exact_[pattern_->first_block(i) + k]);
}

void StepMatrix::balance_rows(const Eigen::VectorXd& sums) {
    parallel_for(node_count(), [&](int i) {
        Eigen::Matrix3d others = Eigen::Matrix3d::Zero();
        for_each_beside(i, [&](int, const auto& block) { others += block; });
        diagonal_[i] = sums[i] * Eigen::Matrix3d::Identity() - 0.5 * (others + others.transpose());
    });
}

void StepMatrix::add_between(int i, int j, const Eigen::Matrix3d& block) {
    const int k = pattern_->find(i, j) - pattern_->first_block(i);
    const Eigen::Matrix3d before = this->block(i, k);
    if (exact_.empty())
        set(i, k, (before + block).cast<float>());
    else
        set_exactly(i, k, before + block);
    const Eigen::Matrix3d added = this->block(i, k) - before;
    diagonal_[i] -= 0.5 * (added + added.transpose());
}

void StepMatrix::isolate(int i) {
    const auto row = pattern_->neighbours(i);
    for (int k = 0; k < std::ssize(row); ++k) {
        const int j = row[k];
        if (j == i) continue;
        const int mirrored = pattern_->find(j, i) - pattern_->first_block(j);
        for (const auto& [at, place] : {std::pair(i, k), std::pair(j, mirrored)})
            if (exact_.empty())
                set(at, place, Eigen::Matrix3f::Zero());
            else
                set_exactly(at, place, Eigen::Matrix3d::Zero());
    }
    diagonal_[i].setIdentity();
}

Eigen::Vector3d StepMatrix::multiply_row(int i, const double* v) const noexcept {
    using At = Eigen::Map<const Eigen::Vector3d>;
    Eigen::Vector3d sum = diagonal_[i] * At(v + 3 * i);
    for_each_beside(i, [&](int j, const auto& block) { sum += block * At(v + 3 * j); });
    return sum;
}

}  // namespace nbd
