#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/factor/cholesky.hpp"

namespace nbd {

/// An approximate inverse of A from its Cholesky factor, packed for speed: symmetric positive definite, with
/// a quarter of the factor's memory. Each supernode's diagonal block D and the rows B below it become one
/// dense matrix [D^-1; B D^-1] of 16-bit integers with one scale per column, so both triangular solves are
/// matrix-vector products.
///
/// The elimination tree is cut into branches of similar work, which are solved in parallel, and a trunk that
/// joins them. The bits do not depend on the number of threads.
///
/// Immutable: any number of threads may solve at once.
class PackedFactor {
 public:
    explicit PackedFactor(const SupernodalFactor& factor);

    int size() const noexcept { return size_; }
    /// [size()] unknown of A at each place of solve()'s vector.
    const std::vector<int>& order() const noexcept { return order_; }
    std::size_t bytes() const noexcept;

    /// Replaces y by approximately A^-1 y; y is in the order of order(). work: caller-owned scratch, grown on
    /// the first call.
    void solve(std::span<float> y, std::vector<float>& work) const;

 private:
    struct Supernode {
        int first = 0, width = 0;  // its columns
        int below = 0;             // number of rows under the diagonal block
        int inside = 0;            // how many of these come before the trunk; they are first
        int stride = 0;            // width + below, rounded up to whole vectors
        int rows = 0;              // start of the rows below in rows_
        std::size_t values = 0;    // start of its matrix in values_
    };
    /// Supernodes [begin, end) in elimination order.
    struct Branch {
        int begin = 0, end = 0;
    };

    static std::vector<int> cut(const SupernodalFactor& factor);
    void pack(const SupernodalFactor& factor, std::size_t supernode, const std::vector<int>& place);
    void forward(const Supernode& node, float* y, float* trunk, float* sum) const noexcept;
    void backward(const Supernode& node, float* y, float* gathered) const noexcept;

    int size_ = 0;
    int longest_ = 0;  // largest stride
    std::vector<int> order_;
    std::vector<Supernode> nodes_;
    std::vector<Branch> branches_;
    Branch trunk_;
    int trunk_first_ = 0;  // first column of the trunk
    std::vector<int> rows_;
    std::vector<float> scale_;          // [size] scale of each column
    std::vector<std::int16_t> values_;  // columns, `stride` apart
};

}  // namespace nbd
