#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "collision/nbd_tree/nbd_networks.hpp"

namespace nbd {

/// One row per pose, of a batch or of a whole data set.
using PoseRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Throws std::invalid_argument unless the shape has inputs and 16, 32 or 64 hidden neurons.
void check_mlp_shape(const MlpShape& shape);

/// Initial weights: uniform within +-sqrt(6 / fan-in) for the ReLU layers and +-sqrt(3 / fan-in) for the
/// last, biases 0. Depends on (seed, stream) alone.
Eigen::VectorXf initial_weights(const MlpShape& shape, std::uint64_t seed, std::uint64_t stream);

/// Arithmetic of the products in a training step. `mixed`: bfloat16 factors (8 bits) and float sums, about
/// twice as fast on CPUs with instructions for it; weights, their updates and outputs stay float.
enum class Arithmetic { single, mixed };

/// True if this build supports the arithmetic.
bool has_arithmetic(Arithmetic arithmetic) noexcept;

/// Name of an arithmetic: "single" or "mixed".
std::string_view name(Arithmetic arithmetic) noexcept;

class PoseBlocks;

/// Runs one network over blocks of training poses. Owns the scratch; use one object per network and thread.
class MlpBatch {
 public:
    /// poses: kept by reference. targets: [poses, 4], in the row order of the inputs. capacity: maximum
    /// blocks per step.
    MlpBatch(int hidden, const PoseBlocks& poses, const PoseRows& targets, int capacity);

    /// Squared error, averaged over the poses of the blocks and the four outputs; always in float.
    float loss(const Eigen::VectorXf& weights, std::span<const int> blocks) noexcept;

    /// As loss(), but in the arithmetic of the poses; also computes the gradient. gradient: out, [weights].
    float loss_and_gradient(const Eigen::VectorXf& weights, std::span<const int> blocks,
                            Eigen::VectorXf& gradient) noexcept;

    const MlpShape& shape() const noexcept { return shape_; }

 private:
    template <int H, class Word>
    float forward(const float* weights, std::span<const int> blocks) noexcept;
    template <int H, class Word>
    void backward(const float* weights, std::span<const int> blocks, float* gradient) noexcept;

    MlpShape shape_;
    const PoseBlocks* poses_;
    // Eigen aligns its arrays to cache lines.
    using Words = Eigen::Matrix<std::uint32_t, Eigen::Dynamic, 1>;
    Eigen::VectorXf targets_;     // [slots, 4]
    Eigen::VectorXf h1_, h2_;     // [slots of a step, hidden]: activations, then deltas
    Eigen::VectorXf d3_;          // [slots of a step, 4]
    Eigen::VectorXf transposed_;  // [hidden, hidden]
    /// bfloat16 pairs of W1, W2, W2 transposed, h1, d2 and d1.
    Words W1_, W2_, W2T_, h1_rows_, h1_slots_, d2_rows_, d2_slots_, d1_slots_;
    std::vector<const float*> pieces_;
    std::vector<const std::uint32_t*> paired_pieces_;
};

}  // namespace nbd
