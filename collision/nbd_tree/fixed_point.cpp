#include "collision/nbd_tree/fixed_point.hpp"

#include <algorithm>

namespace nbd {

FixedMatrix::FixedMatrix(const Eigen::Ref<const Eigen::MatrixXf>& numbers)
    : rows_(numbers.rows()), scales_(numbers.cols()) {
    FixedVector column(rows_);
    for (Eigen::Index c = 0; c < numbers.cols(); ++c) {
        column.numbers() = numbers.col(c);
        column.fix();
        scales_[c] = column.scale();
        // Sums of products could overflow if a factor were max_fixed.
        constexpr std::int16_t most = Kernels::max_fixed - 1;
        for (Eigen::Index r = 0; r < FixedVector::padded(rows_); ++r)
            fixed_.push_back(std::clamp<std::int16_t>(column.fixed()[r], -most, most));
    }
}

Eigen::MatrixXf FixedMatrix::numbers() const {
    using Fixed = Eigen::Matrix<std::int16_t, Eigen::Dynamic, Eigen::Dynamic>;
    const Eigen::Map<const Fixed> all(fixed_.data(), FixedVector::padded(rows_), cols());
    return all.topRows(rows_).cast<float>() * scales_.asDiagonal();
}

bool FixedMatrix::operator==(const FixedMatrix& other) const noexcept {
    return rows_ == other.rows_ && cols() == other.cols() && fixed_ == other.fixed_ &&
           scales_ == other.scales_;
}

void FixedMatrix::transposed_times(const FixedVector& x, Eigen::Ref<Eigen::VectorXf> y) const noexcept {
    kernels().products(columns(0, cols()), x.fixed(), x.scale(), y.data());
}

}  // namespace nbd
