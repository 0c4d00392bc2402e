#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/factor/cholesky.hpp"

namespace nbd {

/// A Cholesky factor packed for speed rather than for digits: a symmetric positive definite stand-in for
/// A^-1 that reads a quarter of the memory of the factor it was made from. Each supernode's diagonal block D
/// and the rows B below it become one dense matrix [D^-1; B D^-1], each column in 16-bit integers with a
/// scale of its own, so that both triangular solves are matrix-vector products.
///
/// The elimination tree is cut into branches of like work, which are solved in parallel; what joins them, the
/// trunk, follows. The same bits on any number of threads.
///
/// Immutable: any number of threads may solve at once.
class PackedFactor {
 public:
    explicit PackedFactor(const SupernodalFactor& factor);

    int size() const noexcept { return size_; }
    /// Unknown of A at each place of solve()'s vector. [size()]
    const std::vector<int>& order() const noexcept { return order_; }
    std::size_t bytes() const noexcept;

    /// y = about A^-1 y, in the order of order(). work: grown on the first call, scratch of the caller.
    void solve(std::span<float> y, std::vector<float>& work) const;

 private:
    struct Supernode {
        int first = 0, width = 0;  // its columns
        int below = 0;             // rows under the diagonal block
        int inside = 0;            // the first of these, outside the trunk
        int stride = 0;            // width + below, rounded up to whole vectors
        int rows = 0;              // where the rows below begin in rows_
        std::size_t values = 0;    // where its matrix begins in values_
    };
    /// Supernodes [begin, end), in the order of elimination.
    struct Branch {
        int begin = 0, end = 0;
    };

    static std::vector<int> cut(const SupernodalFactor& factor);
    void pack(const SupernodalFactor& factor, std::size_t supernode, const std::vector<int>& place);
    void forward(const Supernode& node, float* y, float* trunk, float* sum) const noexcept;
    void backward(const Supernode& node, float* y, float* gathered) const noexcept;

    int size_ = 0;
    int longest_ = 0;  // stride
    std::vector<int> order_;
    std::vector<Supernode> nodes_;
    std::vector<Branch> branches_;
    Branch trunk_;
    int trunk_first_ = 0;  // column
    std::vector<int> rows_;
    std::vector<float> scale_;          // [size] of each column
    std::vector<std::int16_t> values_;  // column by column, `stride` apart
};

}  // namespace nbd
