#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "collision/base/aligned_vector.hpp"
#include "collision/kernels/kernels.hpp"

// Numbers as small integers times a power of two. They take a quarter to half of the memory, and their sums
// are the same on every machine.
namespace nbd {

/// A vector that is written in float and read in fixed point with 14 bits and a sign.
class FixedVector {
 public:
    FixedVector() = default;
    /// Makes a vector of zeros.
    explicit FixedVector(Eigen::Index size) : size_(size), numbers_(padded(size)), fixed_(numbers_.size()) {}

    Eigen::Index size() const noexcept { return size_; }
    Eigen::Map<Eigen::VectorXf> numbers() noexcept { return {numbers_.data(), size_}; }
    Eigen::Map<const Eigen::VectorXf> numbers() const noexcept { return {numbers_.data(), size_}; }
    /// Updates fixed() and scale(). Call it after changing the numbers.
    void fix() noexcept {
        if (size_ > 0) scale_ = kernels().fix(numbers_.data(), numbers_.size(), fixed_.data());
    }

    const std::int16_t* fixed() const noexcept { return fixed_.data(); }
    /// NaN if any number of the vector is not finite.
    float scale() const noexcept { return scale_; }
    /// Length including the zeros at the end.
    static Eigen::Index padded(Eigen::Index size) noexcept { return (size + 31) / 32 * 32; }

 private:
    Eigen::Index size_ = 0;
    AlignedVector<float> numbers_;  // zeros at the end
    AlignedVector<std::int16_t> fixed_;
    float scale_ = 0;
};

/// A matrix in fixed point with 14 bits and a sign, relative to the largest number of each column.
class FixedMatrix {
 public:
    FixedMatrix() = default;
    /// Rounds the numbers; rounded numbers stay the same. A column with a number that is not finite becomes
    /// all NaN.
    explicit FixedMatrix(const Eigen::Ref<const Eigen::MatrixXf>& numbers);

    Eigen::Index rows() const noexcept { return rows_; }
    Eigen::Index cols() const noexcept { return scales_.size(); }
    Eigen::Index size() const noexcept { return rows() * cols(); }
    bool all_finite() const noexcept { return scales_.allFinite(); }
    Eigen::MatrixXf numbers() const;
    bool operator==(const FixedMatrix& other) const noexcept;

    /// y = M^T x. x: [rows], after fix().
    void transposed_times(const FixedVector& x, Eigen::Ref<Eigen::VectorXf> y) const noexcept;
    /// Columns first to first + count - 1.
    FixedColumns columns(Eigen::Index first, Eigen::Index count) const noexcept {
        const Eigen::Index height = FixedVector::padded(rows_);
        return {fixed_.data() + first * height, scales_.data() + first, static_cast<int>(height),
                static_cast<int>(count)};
    }

 private:
    Eigen::Index rows_ = 0;
    AlignedVector<std::int16_t> fixed_;  // column by column, each padded with zeros
    Eigen::VectorXf scales_;             // [cols]
};

}  // namespace nbd
