#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "collision/bounds/learned/mlp_shape.hpp"

namespace nbd {

/// Rows are poses: a batch or a whole data set.
using PoseRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Throws std::invalid_argument unless the shape has inputs and 16, 32 or 64 hidden neurons.
void check_mlp_shape(const MlpShape& shape);

/// Weights drawn uniformly within sqrt(6 / fan-in) for the ReLU layers and sqrt(3 / fan-in) for the last,
/// biases 0. Depends on (seed, stream) alone.
Eigen::VectorXf initial_weights(const MlpShape& shape, std::uint64_t seed, std::uint64_t stream);

/// How a training step multiplies. `mixed`: factors of 8 bits (bfloat16), sums in float, about twice as fast
/// where the processor has instructions for it; weights, their sums and what comes out stay float.
enum class Arithmetic { single, mixed };

/// Whether this build can multiply in that way.
bool has_arithmetic(Arithmetic arithmetic) noexcept;

/// "single", "mixed".
std::string_view name(Arithmetic arithmetic) noexcept;

class PoseBlocks;

/// Runs one network over blocks of training poses. Owns the scratch; one object a network and thread.
class MlpBatch {
 public:
    /// poses: referred to. targets: [poses, 4], rows as those of the inputs. capacity: the most blocks of a
    /// step.
    MlpBatch(int hidden, const PoseBlocks& poses, const PoseRows& targets, int capacity);

    /// Mean over the poses of the blocks and the four outputs of the squared error, always in float.
    float loss(const Eigen::VectorXf& weights, std::span<const int> blocks) noexcept;

    /// The same in the arithmetic of the poses, and the gradient of that mean by every weight. gradient: out,
    /// [weights].
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
    // Eigen's arrays begin where a cache line does.
    using Words = Eigen::Matrix<std::uint32_t, Eigen::Dynamic, 1>;
    Eigen::VectorXf targets_;     // [slots, 4]
    Eigen::VectorXf h1_, h2_;     // [slots of a step, hidden]: what the layers gave, then what goes back
    Eigen::VectorXf d3_;          // [slots of a step, 4]
    Eigen::VectorXf transposed_;  // [hidden, hidden]
    /// Neighbouring pairs of W1, W2, W2 transposed, h1, d2 and d1, rounded.
    Words W1_, W2_, W2T_, h1_rows_, h1_slots_, d2_rows_, d2_slots_, d1_slots_;
    std::vector<const float*> pieces_;
    std::vector<const std::uint32_t*> paired_pieces_;
};

}  // namespace nbd
