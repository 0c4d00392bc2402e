#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace nbd {

/// Rows are poses: a batch or a whole data set.
using PoseRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Shape of one node's network: inputs-hidden-hidden-4 with ReLU between the layers. Its weights lie flat
/// as in ModalModel: W1 [hidden, inputs], b1, W2 [hidden, hidden], b2, W3 [4, hidden], b3, every matrix
/// column-major.
struct MlpShape {
    static constexpr int outputs = 4;
    int inputs = 128;
    int hidden = 32;  // 16, 32 or 64: the kernels are compiled for these

    int W1() const noexcept { return 0; }
    int b1() const noexcept { return hidden * inputs; }
    int W2() const noexcept { return b1() + hidden; }
    int b2() const noexcept { return W2() + hidden * hidden; }
    int W3() const noexcept { return b2() + hidden; }
    int b3() const noexcept { return W3() + outputs * hidden; }
    int weights() const noexcept { return b3() + outputs; }
};

/// Throws std::invalid_argument unless the kernels know the shape.
void check_mlp_shape(const MlpShape& shape);

/// Weights drawn uniformly within sqrt(6 / fan-in) for the ReLU layers and sqrt(3 / fan-in) for the last,
/// biases 0. Depends on (seed, stream) alone.
Eigen::VectorXf initial_weights(const MlpShape& shape, std::uint64_t seed, std::uint64_t stream);

/// Runs one network over batches of poses. Owns the scratch; one object a thread.
class MlpBatch {
 public:
    /// capacity: the most poses of a batch.
    MlpBatch(const MlpShape& shape, int capacity);

    /// Copies rows `poses[0 .. count)` of the data set as the current batch. inputs: [*, shape.inputs];
    /// targets: [*, 4]. Throws nothing; count must lie in [1, capacity].
    void gather(const PoseRows& inputs, const PoseRows& targets, const int* poses, int count) noexcept;

    /// Mean over the batch's poses and the four outputs of the squared error.
    float loss(const Eigen::VectorXf& weights) noexcept;

    /// Same, and the gradient of that mean by every weight. gradient: out, [shape.weights()].
    float loss_and_gradient(const Eigen::VectorXf& weights, Eigen::VectorXf& gradient) noexcept;

 private:
    template <int H>
    float forward(const float* weights) noexcept;
    template <int H>
    void backward(const float* weights, float* gradient) noexcept;

    MlpShape shape_;
    int count_ = 0, stride_ = 0;  // poses; floats between two rows of x_
    Eigen::VectorXf x_, target_, h1_, h2_, d1_, d2_, d3_, transposed_;
};

}  // namespace nbd
