#include "collision/nbd_tree/nbd_networks.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "collision/base/message.hpp"

namespace nbd {
namespace {

constexpr int most = 127;

/// The scale for numbers up to `largest`. It has few enough digits for most * scale to be exact, so rounded
/// numbers get the same scale again.
float scale_for(float largest) noexcept {
    const auto bits = std::bit_cast<std::uint32_t>(largest / most);
    return std::bit_cast<float>((bits + 0xffu) & ~0xffu);
}

}  // namespace

std::string_view name(NetworkNumbers numbers) noexcept {
    return numbers == NetworkNumbers::bytes ? "bytes" : "floats";
}

NbdNetworks::NbdNetworks(int inputs, int hidden, std::span<const float> weights, NetworkNumbers numbers)
    : numbers_(numbers), inputs_(inputs), hidden_(hidden) {
    constexpr Requirement require("NBD-Tree");
    require(inputs >= 1 && inputs <= max_inputs, inputs, " inputs, allowed: 1 to ", max_inputs);
    require(hidden >= 1 && hidden <= max_hidden, "hidden width ", hidden, ", allowed: 1 to ", max_hidden);
    const std::size_t each = weight_count();
    require(weights.size() % each == 0, weights.size(), " weights, allowed: multiples of ", each);
    count_ = static_cast<int>(weights.size() / each);
    for (int i = 0; i < count_; ++i) {
        const Eigen::Map<const Eigen::VectorXf> own(weights.data() + i * std::ptrdiff_t{weight_count()},
                                                    weight_count());
        require(own.allFinite(), "a weight of node ", i, " is not finite");
    }
    if (numbers == NetworkNumbers::bytes)
        round(weights);
    else
        floats_.assign(weights.begin(), weights.end());
}

void NbdNetworks::round(std::span<const float> weights) {
    for (int l = 0; l < layers; ++l) {
        const std::size_t at = l;
        places_[at + 1] = {places_[at].bytes + padded(layer_inputs(l)) * padded(layer_outputs(l)),
                           places_[at].outputs + padded(layer_outputs(l))};
    }
    const std::size_t networks = count_;
    bytes_.resize(networks * static_cast<std::size_t>(places_.back().bytes));
    sums_.resize(networks * static_cast<std::size_t>(places_.back().outputs));
    scales_.resize(2 * sums_.size());
    const float* next = weights.data();
    for (int i = 0; i < count_; ++i)
        for (int l = 0; l < layers; ++l) {
            const Eigen::Index in = layer_inputs(l), out = layer_outputs(l);
            const Eigen::Map<const Eigen::MatrixXf> W(next, out, in);
            const Eigen::Map<const Eigen::VectorXf> b(next + in * out, out);
            next += (in + 1) * out;
            const ByteLayer to = layer(i, l);
            std::int8_t* bytes = bytes_.data() + (to.weights - bytes_.data());
            std::int32_t* sums = sums_.data() + (to.sums - sums_.data());
            float *scales = scales_.data() + (to.scales - scales_.data()), *biases = scales + to.outputs;
            for (int o = 0; o < static_cast<int>(out); ++o) {
                scales[o] = scale_for(W.row(o).cwiseAbs().maxCoeff());
                biases[o] = b[o];
                if (scales[o] == 0) continue;
                for (int k = 0; k < static_cast<int>(in); ++k) {
                    const auto weight =
                        std::clamp(static_cast<int>(std::lrint(W(o, k) / scales[o])), -most, most);
                    bytes[to.at(o, k)] = static_cast<std::int8_t>(weight);
                    sums[o] += weight;
                }
            }
        }
}

std::vector<float> NbdNetworks::weights() const {
    if (numbers_ == NetworkNumbers::floats) return floats_;
    std::vector<float> weights;
    weights.reserve(static_cast<std::size_t>(count_) * static_cast<std::size_t>(weight_count()));
    for (int i = 0; i < count_; ++i)
        for (int l = 0; l < layers; ++l) {
            const ByteLayer from = layer(i, l);
            for (int k = 0; k < layer_inputs(l); ++k)
                for (int o = 0; o < layer_outputs(l); ++o)
                    weights.push_back(from.scales[o] * static_cast<float>(from.weights[from.at(o, k)]));
            weights.insert(weights.end(), from.biases, from.biases + layer_outputs(l));
        }
    return weights;
}

ByteLayer NbdNetworks::layer(int i, int layer) const noexcept {
    const Place &place = places_[layer], &whole = places_.back();
    const std::ptrdiff_t output = std::ptrdiff_t{i} * whole.outputs + place.outputs;
    const int outputs = padded(layer_outputs(layer));
    return {.weights = bytes_.data() + std::ptrdiff_t{i} * whole.bytes + place.bytes,
            .sums = sums_.data() + output,
            .scales = scales_.data() + 2 * output,
            .biases = scales_.data() + 2 * output + outputs,
            .quads = padded(layer_inputs(layer)) / 4,
            .outputs = outputs,
            .relu = layer < layers - 1};
}

Eigen::Array4f NbdNetworks::evaluate_floats(int i, const FixedVector& x) const noexcept {
    if (std::isnan(x.scale())) return Eigen::Array4f::Constant(x.scale());
    using Layer = Eigen::Matrix<float, Eigen::Dynamic, 1, 0, std::max(max_inputs, max_hidden), 1>;
    const float* next = floats_.data() + std::ptrdiff_t{i} * weight_count();
    Layer values = x.numbers();
    for (int l = 0; l < layers; ++l) {
        const Eigen::Index in = layer_inputs(l), out = layer_outputs(l);
        const Eigen::Map<const Eigen::MatrixXf> W(next, out, in);
        Layer sums = Eigen::Map<const Eigen::VectorXf>(next + in * out, out);
        for (Eigen::Index k = 0; k < in; ++k) sums += values[k] * W.col(k);
        if (l < layers - 1) sums = sums.cwiseMax(0);
        values = sums;
        next += (in + 1) * out;
    }
    return values.head<outputs>();
}

void NbdNetworks::evaluate(int first, const FixedVector& x, std::span<Eigen::Array4f> results,
                           const FixedColumns& columns, float* products) const noexcept {
    if (numbers_ == NetworkNumbers::floats) {
        for (std::size_t i = 0; i < results.size(); ++i)
            results[i] = evaluate_floats(first + static_cast<int>(i), x);
        kernels().products(columns, x.fixed(), x.scale(), products);
        return;
    }
    ByteLayer all[max_at_once][layers];
    const int count = results.size();
    for (int i = 0; i < count; ++i)
        for (int l = 0; l < layers; ++l) all[i][l] = layer(first + i, l);
    alignas(64) float numbers[max_at_once][lanes];
    kernels().networks(all, count, columns, x.fixed(), x.scale(), numbers, products);
    for (std::size_t i = 0; i < results.size(); ++i)
        results[i] = Eigen::Map<const Eigen::Array4f>(numbers[i]);
}

}  // namespace nbd
