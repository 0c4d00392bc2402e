#include "training/mlp.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "collision/counter_random.hpp"
#include "training/dense_kernel.hpp"

namespace nbd {

namespace {

using dense_kernel::Adjacent;
using dense_kernel::multiply;

constexpr int outputs = MlpShape::outputs;

/// Calls f.template operator()<H>() for the compiled width `hidden`.
template <class F>
auto with_width(int hidden, F&& f) {
    switch (hidden) {
        case 16:
            return f.template operator()<16>();
        case 64:
            return f.template operator()<64>();
        default:
            return f.template operator()<32>();
    }
}

/// out[c][r] = in[r][c].
void transpose(const float* in, int rows, int columns, float* out) noexcept {
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) out[c * rows + r] = in[r * columns + c];
}

/// sum[h] = sum over poses of d[pose][h].
template <int H>
void add_rows(const float* d, int poses, float* sum) noexcept {
    float total[H] = {};
    for (int p = 0; p < poses; ++p)
        for (int h = 0; h < H; ++h) total[h] += d[p * H + h];
    std::copy_n(total, H, sum);
}

}  // namespace

void check_mlp_shape(const MlpShape& shape) {
    if (shape.inputs < 1)
        throw std::invalid_argument(fmt::format("network has {} inputs, at least 1 needed", shape.inputs));
    if (shape.hidden != 16 && shape.hidden != 32 && shape.hidden != 64)
        throw std::invalid_argument(
            fmt::format("hidden layers of {} neurons, allowed are 16, 32 and 64", shape.hidden));
}

Eigen::VectorXf initial_weights(const MlpShape& shape, std::uint64_t seed, std::uint64_t stream) {
    Eigen::VectorXf w = Eigen::VectorXf::Zero(shape.weights());
    const auto draw = [&](int begin, int end, double bound) {
        for (int i = begin; i < end; ++i)
            w[i] = static_cast<float>(bound *
                                      (2 * counter_uniform(seed, stream, static_cast<std::uint64_t>(i)) - 1));
    };
    draw(shape.W1(), shape.b1(), std::sqrt(6.0 / shape.inputs));
    draw(shape.W2(), shape.b2(), std::sqrt(6.0 / shape.hidden));
    draw(shape.W3(), shape.b3(), std::sqrt(3.0 / shape.hidden));
    return w;
}

MlpBatch::MlpBatch(const MlpShape& shape, int capacity)
    : shape_(shape),
      // Rows a power of two apart would share a few sets of the first cache.
      stride_((shape.inputs + 15) / 16 * 16 + 16),
      x_(Eigen::VectorXf::Zero(capacity * stride_)),
      target_(capacity * outputs),
      h1_(capacity * shape.hidden),
      h2_(capacity * shape.hidden),
      d1_(capacity * shape.hidden),
      d2_(capacity * shape.hidden),
      d3_(capacity * outputs),
      transposed_(shape.hidden * shape.hidden) {}

void MlpBatch::gather(const PoseRows& inputs, const PoseRows& targets, const int* poses, int count) noexcept {
    count_ = count;
    for (int p = 0; p < count; ++p) {
        // Poses are far apart in memory: without this the copy waits for every one.
        const int ahead = poses[std::min(p + 8, count - 1)];
        for (int i = 0; i < shape_.inputs; i += 16)
            __builtin_prefetch(inputs.data() + static_cast<std::ptrdiff_t>(ahead) * shape_.inputs + i);
        std::copy_n(inputs.data() + static_cast<std::ptrdiff_t>(poses[p]) * shape_.inputs, shape_.inputs,
                    x_.data() + p * stride_);
        std::copy_n(targets.data() + static_cast<std::ptrdiff_t>(poses[p]) * outputs, outputs,
                    target_.data() + p * outputs);
    }
}

template <int H>
float MlpBatch::forward(const float* w) noexcept {
    const auto relu = [n = count_ * H](float* h) {
        for (int i = 0; i < n; ++i) h[i] = h[i] > 0 ? h[i] : 0;
    };
    multiply<H, Adjacent::k>(w + shape_.W1(), shape_.inputs, x_.data(), stride_, count_, w + shape_.b1(),
                             h1_.data());
    relu(h1_.data());
    multiply<H, Adjacent::k>(w + shape_.W2(), H, h1_.data(), H, count_, w + shape_.b2(), h2_.data());
    relu(h2_.data());

    // d3 takes the error of each output, which is its derivative up to a factor.
    using Four = Eigen::Array4f;
    const Eigen::Map<const Eigen::Array<float, outputs, H>> W3(w + shape_.W3());
    const Eigen::Map<const Four> b3(w + shape_.b3());
    Four total = Four::Zero();
    for (int p = 0; p < count_; ++p) {
        Four o = b3;
        for (int h = 0; h < H; ++h) o += W3.col(h) * h2_[p * H + h];
        o -= target_.segment<outputs>(p * outputs).array();
        d3_.segment<outputs>(p * outputs) = o.matrix();
        total += o * o;
    }
    return total.sum() / static_cast<float>(outputs * count_);
}

template <int H>
void MlpBatch::backward(const float* w, float* g) noexcept {
    const int n = count_;
    d3_.head(n * outputs) *= 2 / static_cast<float>(outputs * n);
    // Through ReLU: a neuron that gave 0 passes nothing back.
    const auto mask = [n](const float* h, float* d) {
        for (int i = 0; i < n * H; ++i) d[i] = h[i] > 0 ? d[i] : 0;
    };
    float* rows = transposed_.data();

    float g3[outputs * H];
    multiply<H, Adjacent::n>(h2_.data(), n, d3_.data(), outputs, outputs, nullptr, g3);
    transpose(g3, outputs, H, g + shape_.W3());
    add_rows<outputs>(d3_.data(), n, g + shape_.b3());
    transpose(w + shape_.W3(), H, outputs, rows);
    multiply<H, Adjacent::k>(rows, outputs, d3_.data(), outputs, n, nullptr, d2_.data());
    mask(h2_.data(), d2_.data());

    multiply<H, Adjacent::n>(d2_.data(), n, h1_.data(), H, H, nullptr, g + shape_.W2());
    add_rows<H>(d2_.data(), n, g + shape_.b2());
    transpose(w + shape_.W2(), H, H, rows);
    multiply<H, Adjacent::k>(rows, H, d2_.data(), H, n, nullptr, d1_.data());
    mask(h1_.data(), d1_.data());

    multiply<H, Adjacent::n>(d1_.data(), n, x_.data(), stride_, shape_.inputs, nullptr, g + shape_.W1());
    add_rows<H>(d1_.data(), n, g + shape_.b1());
}

float MlpBatch::loss(const Eigen::VectorXf& weights) noexcept {
    return with_width(shape_.hidden, [&]<int H>() { return forward<H>(weights.data()); });
}

float MlpBatch::loss_and_gradient(const Eigen::VectorXf& weights, Eigen::VectorXf& gradient) noexcept {
    return with_width(shape_.hidden, [&]<int H>() {
        const float loss = forward<H>(weights.data());
        backward<H>(weights.data(), gradient.data());
        return loss;
    });
}

}  // namespace nbd
