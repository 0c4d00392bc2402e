#pragma once

namespace nbd {

/// Shape of one node's network: inputs-hidden-hidden-4 with ReLU between the layers. Its weights are one flat
/// array: W1 [hidden, inputs], b1, W2 [hidden, hidden], b2, W3 [4, hidden], b3, every matrix column-major.
struct MlpShape {
    static constexpr int outputs = 4;  // centre x, y, z and radius of the node's sphere, scaled
    int inputs = 128;
    int hidden = 32;  // training allows 16, 32 or 64, see check_mlp_shape()

    /// Offsets of the parts in the array.
    constexpr int W1() const noexcept { return 0; }
    constexpr int b1() const noexcept { return hidden * inputs; }
    constexpr int W2() const noexcept { return b1() + hidden; }
    constexpr int b2() const noexcept { return W2() + hidden * hidden; }
    constexpr int W3() const noexcept { return b2() + hidden; }
    constexpr int b3() const noexcept { return W3() + outputs * hidden; }
    /// Length of the array: number of weights and biases.
    constexpr int weights() const noexcept { return b3() + outputs; }
};

}  // namespace nbd
