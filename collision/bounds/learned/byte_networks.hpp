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

/// Small ReLU networks of one shape, two hidden layers of one width each, with weights of a byte: one of the
/// paper's takes 6.6 kB. Each output of a layer has a scale of its own. What a layer reads is rounded beside
/// its largest number: the networks' inputs to 14 bits, what hidden layers give to 8.
class ByteNetworks {
 public:
    static constexpr int outputs = MlpShape::outputs, max_hidden = Kernels::max_hidden;
    static constexpr int max_inputs = Kernels::max_inputs;

    ByteNetworks() = default;
    /// weights: network after network, each as MlpShape says. They are rounded; what has been rounded before
    /// stays what it is.
    /// Throws std::invalid_argument on a shape that is not allowed, on weights that are no whole networks,
    /// and on what is not finite.
    ByteNetworks(int inputs, int hidden, std::span<const float> weights);

    int inputs() const noexcept { return inputs_; }
    int hidden() const noexcept { return hidden_; }
    int count() const noexcept { return count_; }
    /// Numbers of one.
    int weight_count() const noexcept { return weight_count(inputs_, hidden_); }
    static constexpr int weight_count(int inputs, int hidden) noexcept {
        return MlpShape{.inputs = inputs, .hidden = hidden}.weights();
    }
    /// As the constructor takes them.
    std::vector<float> weights() const;

    /// What networks first to first + results.size() - 1, at most max_at_once of them, make of x, [inputs],
    /// fixed. Not a number where the scale of x is none. Besides the products of x and some columns, of which
    /// there may be none: they cost little here.
    void evaluate(int first, const FixedVector& x, std::span<Eigen::Array4f> results,
                  const FixedColumns& columns = {}, float* products = nullptr) const noexcept;
    static constexpr int max_at_once = Kernels::max_networks;

 private:
    static constexpr int layers = 3, lanes = kernel_lanes;
    static constexpr int padded(int count) noexcept { return (count + lanes - 1) / lanes * lanes; }
    int layer_inputs(int layer) const noexcept { return layer == 0 ? inputs_ : hidden_; }
    int layer_outputs(int layer) const noexcept { return layer == layers - 1 ? outputs : hidden_; }
    /// A layer of network i as the kernels take it: with inputs and outputs in groups, zeros added.
    ByteLayer layer(int i, int layer) const noexcept;

    int inputs_ = 0, hidden_ = 0, count_ = 0;
    struct Place {
        int bytes = 0, outputs = 0;  // of a network that come before
    };
    std::array<Place, layers + 1> places_;  // the last one: of the whole network
    // Layer after layer, see ByteLayer.
    AlignedVector<std::int8_t> bytes_;
    AlignedVector<std::int32_t> sums_;
    AlignedVector<float> numbers_;  // a layer's scales, then its biases
};

}  // namespace nbd
