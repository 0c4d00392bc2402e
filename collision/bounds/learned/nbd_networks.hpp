#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/base/aligned_vector.hpp"
#include "collision/bounds/learned/fixed_point.hpp"
#include "collision/bounds/learned/mlp_shape.hpp"
#include "collision/kernels/packs.hpp"

namespace nbd {

/// Small ReLU networks of one shape, with two hidden layers of equal width and one-byte weights: a network of
/// the paper takes 6.6 kB. Each output of a layer has its own scale. The inputs of a layer are rounded
/// relative to the largest of them: the networks' inputs to 14 bits, hidden values to 8.
class NbdNetworks {
 public:
    static constexpr int outputs = MlpShape::outputs, max_hidden = Kernels::max_hidden;
    static constexpr int max_inputs = Kernels::max_inputs;

    NbdNetworks() = default;
    /// weights: network after network, each in the order of MlpShape. Rounds the weights; rounded weights
    /// stay the same. Throws std::invalid_argument on a shape that is not allowed, on a number of weights
    /// that is not a multiple of weight_count(), and on weights that are not finite.
    NbdNetworks(int inputs, int hidden, std::span<const float> weights);

    int inputs() const noexcept { return inputs_; }
    int hidden() const noexcept { return hidden_; }
    int count() const noexcept { return count_; }
    /// Number of weights of one network.
    int weight_count() const noexcept { return weight_count(inputs_, hidden_); }
    static constexpr int weight_count(int inputs, int hidden) noexcept {
        return MlpShape{.inputs = inputs, .hidden = hidden}.weights();
    }
    /// The rounded weights, in the order of the constructor.
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
    /// A layer of network i as kernels read it, with inputs and outputs padded by zeros to whole groups.
    ByteLayer layer(int i, int layer) const noexcept;

    int inputs_ = 0, hidden_ = 0, count_ = 0;
    struct Place {
        int bytes = 0, outputs = 0;  // number of bytes and outputs of a network before a layer
    };
    std::array<Place, layers + 1> places_;  // the last entry is for the whole network
    // Stored layer by layer, see ByteLayer.
    AlignedVector<std::int8_t> bytes_;
    AlignedVector<std::int32_t> sums_;
    AlignedVector<float> numbers_;  // a layer's scales, then its biases
};

}  // namespace nbd
