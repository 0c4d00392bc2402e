#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "collision/base/aligned_vector.hpp"
#include "collision/kernels/packs.hpp"
#include "collision/nbd_tree/fixed_point.hpp"

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

/// Numbers of the networks. `bytes`: one-byte weights, each output of a layer with its own scale. The inputs
/// of a layer are rounded relative to the largest of them: the networks' inputs to 14 bits, hidden values
/// to 8. `floats`: float32 throughout, as in the paper; three times the memory, and slower.
enum class NetworkNumbers { bytes, floats };

/// Name of the numbers: "bytes" or "floats".
std::string_view name(NetworkNumbers numbers) noexcept;

/// Small ReLU networks of one shape, with two hidden layers of equal width. A network of the paper's shape
/// takes 6.6 kB in bytes, 21.3 kB in floats.
class NbdNetworks {
 public:
    static constexpr int outputs = MlpShape::outputs, max_hidden = Kernels::max_hidden;
    static constexpr int max_inputs = Kernels::max_inputs;

    NbdNetworks() = default;
    /// weights: network after network, each in the order of MlpShape. `bytes` rounds them; rounded weights
    /// stay the same. Throws std::invalid_argument on a shape that is not allowed, on a number of weights
    /// that is not a multiple of weight_count(), and on weights that are not finite.
    NbdNetworks(int inputs, int hidden, std::span<const float> weights,
                NetworkNumbers numbers = NetworkNumbers::bytes);

    int inputs() const noexcept { return inputs_; }
    int hidden() const noexcept { return hidden_; }
    int count() const noexcept { return count_; }
    NetworkNumbers numbers() const noexcept { return numbers_; }
    /// Number of weights of one network.
    int weight_count() const noexcept { return weight_count(inputs_, hidden_); }
    static constexpr int weight_count(int inputs, int hidden) noexcept {
        return MlpShape{.inputs = inputs, .hidden = hidden}.weights();
    }
    /// The weights as stored, rounded if they are bytes, in the order of the constructor.
    std::vector<float> weights() const;

    /// Evaluates networks first to first + results.size() - 1, at most max_at_once, on x: [inputs], after
    /// fix(). Results are NaN if the scale of x is NaN. Also computes the products of x with `columns`,
    /// possibly none, which cost little here.
    void evaluate(int first, const FixedVector& x, std::span<Eigen::Array4f> results,
                  const FixedColumns& columns = {}, float* products = nullptr) const noexcept;
    static constexpr int max_at_once = Kernels::max_networks;

 private:
    static constexpr int layers = 3, lanes = kernel_lanes;
    static constexpr int padded(int count) noexcept { return (count + lanes - 1) / lanes * lanes; }
    int layer_inputs(int layer) const noexcept { return layer == 0 ? inputs_ : hidden_; }
    int layer_outputs(int layer) const noexcept { return layer == layers - 1 ? outputs : hidden_; }
    void round(std::span<const float> weights);
    /// A layer of network i as kernels read it, with inputs and outputs padded by zeros to whole groups.
    ByteLayer layer(int i, int layer) const noexcept;
    Eigen::Array4f evaluate_floats(int i, const FixedVector& x) const noexcept;

    NetworkNumbers numbers_ = NetworkNumbers::bytes;
    int inputs_ = 0, hidden_ = 0, count_ = 0;
    struct Place {
        int bytes = 0, outputs = 0;  // number of bytes and outputs of a network before a layer
    };
    std::array<Place, layers + 1> places_;  // the last entry is for the whole network
    std::vector<float> floats_;             // in the order of the constructor; empty if the numbers are bytes
    // Stored layer by layer, see ByteLayer; empty if the numbers are floats.
    AlignedVector<std::int8_t> bytes_;
    AlignedVector<std::int32_t> sums_;
    AlignedVector<float> scales_;  // a layer's scales, then its biases
};

}  // namespace nbd
