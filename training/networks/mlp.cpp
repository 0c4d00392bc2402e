#include "training/networks/mlp.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>

#include "collision/base/counter_random.hpp"
#include "training/networks/dense_kernel.hpp"
#include "training/networks/pose_blocks.hpp"

namespace nbd {

namespace {

using dense_kernel::add_rows;
using dense_kernel::Adjacent;
using dense_kernel::Finish;
using dense_kernel::multiply;
using dense_kernel::Pair;

constexpr int outputs = MlpShape::outputs;

/// Calls f.template operator()<H, Word>() with H = hidden and the word type of the factors.
template <class F>
auto with_kernel(int hidden, Arithmetic arithmetic, F&& f) {
    const auto with_word = [&]<class Word>() {
        switch (hidden) {
            case 16:
                return f.template operator()<16, Word>();
            case 64:
                return f.template operator()<64, Word>();
            default:
                return f.template operator()<32, Word>();
        }
    };
    if constexpr (dense_kernel::has_pairs)
        if (arithmetic == Arithmetic::mixed) return with_word.template operator()<Pair>();
    return with_word.template operator()<float>();
}

/// Numbers per word.
template <class Word>
constexpr int packed = std::is_same_v<Word, Pair> ? 2 : 1;

/// x, [n, H], packed along rows; returns x itself if Word is float.
template <int H, class Word>
const Word* along_rows(const float* x, [[maybe_unused]] int n, [[maybe_unused]] Pair* scratch) noexcept {
    if constexpr (std::is_same_v<Word, float>) {
        return x;
    } else {
        dense_kernel::pair_columns<H>(x, n, scratch);
        return scratch;
    }
}

/// x, [n, H], packed along columns to [n / packed, H]; returns x itself if Word is float.
template <int H, class Word>
const Word* across_rows(const float* x, [[maybe_unused]] int n, [[maybe_unused]] Pair* scratch) noexcept {
    if constexpr (std::is_same_v<Word, float>) {
        return x;
    } else {
        dense_kernel::pair_rows<H>(x, n, scratch);
        return scratch;
    }
}

/// out[c][r] = in[r][c].
void transpose(const float* in, int rows, int columns, float* out) noexcept {
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) out[c * rows + r] = in[r * columns + c];
}

}  // namespace

void check_mlp_shape(const MlpShape& shape) {
    if (shape.inputs < 1)
        throw std::invalid_argument(fmt::format("network has {} inputs, at least 1 needed", shape.inputs));
    if (shape.hidden != 16 && shape.hidden != 32 && shape.hidden != 64)
        throw std::invalid_argument(
            fmt::format("hidden layers of {} neurons; allowed: 16, 32 and 64", shape.hidden));
}

Eigen::VectorXf initial_weights(const MlpShape& shape, std::uint64_t seed, std::uint64_t stream) {
    Eigen::VectorXf w = Eigen::VectorXf::Zero(shape.weights());
    const auto draw = [&](int begin, int end, double bound) {
        for (int i = begin; i < end; ++i)
            w[i] = static_cast<float>(bound * (2 * counter_uniform(seed, stream, i) - 1));
    };
    draw(shape.W1(), shape.b1(), std::sqrt(6.0 / shape.inputs));
    draw(shape.W2(), shape.b2(), std::sqrt(6.0 / shape.hidden));
    draw(shape.W3(), shape.b3(), std::sqrt(3.0 / shape.hidden));
    return w;
}

bool has_arithmetic(Arithmetic arithmetic) noexcept {
    return arithmetic == Arithmetic::single || dense_kernel::has_pairs;
}

std::string_view name(Arithmetic arithmetic) noexcept {
    return arithmetic == Arithmetic::single ? "single" : "mixed";
}

MlpBatch::MlpBatch(int hidden, const PoseBlocks& poses, const PoseRows& targets, int capacity)
    : shape_{.inputs = poses.inputs(), .hidden = hidden},
      poses_(&poses),
      targets_(Eigen::VectorXf::Zero(poses.blocks() * PoseBlocks::block * outputs)) {
    for (int s = 0; s < poses.poses(); ++s)
        targets_.segment<outputs>(s * outputs) = targets.row(poses.order()[s]);
    const int slots = capacity * PoseBlocks::block;
    for (auto* layer : {&h1_, &h2_}) layer->resize(slots * hidden);
    d3_.resize(slots * outputs);
    transposed_.resize(hidden * hidden);
    pieces_.resize(capacity);
    if (poses.arithmetic() == Arithmetic::single) return;
    W1_.resize(poses.pairs() * hidden);
    for (auto* W : {&W2_, &W2T_}) W->resize(hidden * hidden / 2);
    for (auto* layer : {&h1_rows_, &h1_slots_, &d2_rows_, &d2_slots_, &d1_slots_})
        layer->resize(slots * hidden / 2);
    paired_pieces_.resize(capacity);
}

template <int H, class Word>
float MlpBatch::forward(const float* w, std::span<const int> blocks) noexcept {
    constexpr int block = PoseBlocks::block;
    const int n = blocks.size() * block;
    const Word* W1 = across_rows<H, Word>(w + shape_.W1(), shape_.inputs, W1_.data());
    for (std::size_t j = 0; j < blocks.size(); ++j) {
        float* h1 = h1_.data() + j * block * H;
        if constexpr (std::is_same_v<Word, float>)
            multiply<H, Adjacent::k, Finish::relu>(W1, shape_.inputs, poses_->rows(blocks[j]),
                                                   poses_->stride(), block, w + shape_.b1(), h1);
        else
            multiply<H, Adjacent::k, Finish::relu>(W1, poses_->pairs(), poses_->paired_rows(blocks[j]),
                                                   poses_->pairs(), block, w + shape_.b1(), h1);
    }
    constexpr int words = H / packed<Word>;
    multiply<H, Adjacent::k, Finish::relu>(across_rows<H, Word>(w + shape_.W2(), H, W2_.data()), words,
                                           along_rows<H, Word>(h1_.data(), n, h1_rows_.data()), words, n,
                                           w + shape_.b2(), h2_.data());

    // d3 holds the error of each output, which is its derivative up to a factor. Four poses at a time keep
    // four independent sums in flight.
    using Four = Eigen::Array4f;
    const Eigen::Map<const Eigen::Array<float, outputs, H>> W3(w + shape_.W3());
    const Four b3 = Eigen::Map<const Four>(w + shape_.b3());
    Four total = Four::Zero();
    int poses = 0;
    for (std::size_t j = 0; j < blocks.size(); ++j) {
        const int first = blocks[j] * block, filled = std::min(block, poses_->poses() - first);
        poses += filled;
        for (int i = 0; i < block; i += 4) {
            const float* h2 = h2_.data() + (j * block + i) * H;
            Four o[4] = {b3, b3, b3, b3};
            for (int h = 0; h < H; ++h)
                for (int p = 0; p < 4; ++p) o[p] += W3.col(h) * h2[p * H + h];
            for (int p = 0; p < 4; ++p) {
                const float* target = targets_.data() + (first + i + p) * outputs;
                o[p] = i + p < filled ? (o[p] - Eigen::Map<const Four>(target)).eval() : Four::Zero().eval();
                Eigen::Map<Four>(d3_.data() + (j * block + i + p) * outputs) = o[p];
                total += o[p] * o[p];
            }
        }
    }
    const float scale = 1 / static_cast<float>(outputs * poses);
    d3_.head(n * outputs) *= 2 * scale;
    return total.sum() * scale;
}

template <int H, class Word>
void MlpBatch::backward(const float* w, std::span<const int> blocks, float* g) noexcept {
    const int n = blocks.size() * PoseBlocks::block;
    float* rows = transposed_.data();
    constexpr int words = H / packed<Word>;
    const int slots = n / packed<Word>;

    float g3[outputs * H];
    multiply<H, Adjacent::n>(h2_.data(), n, d3_.data(), outputs, outputs, nullptr, g3);
    transpose(g3, outputs, H, g + shape_.W3());
    Eigen::Map<Eigen::Array4f>(g + shape_.b3()) =
        Eigen::Map<const Eigen::Array<float, outputs, Eigen::Dynamic>>(d3_.data(), outputs, n)
            .rowwise()
            .sum();
    // ReLU passes no gradient back through a neuron with output 0. From here on h2_ and h1_ hold the deltas.
    transpose(w + shape_.W3(), H, outputs, rows);
    multiply<H, Adjacent::k, Finish::gate>(rows, outputs, d3_.data(), outputs, n, nullptr, h2_.data());
    const float* d2 = h2_.data();

    multiply<H, Adjacent::n>(across_rows<H, Word>(d2, n, d2_slots_.data()), slots,
                             across_rows<H, Word>(h1_.data(), n, h1_slots_.data()), H, H, nullptr,
                             g + shape_.W2());
    add_rows<H>(d2, n, g + shape_.b2());
    transpose(w + shape_.W2(), H, H, rows);
    multiply<H, Adjacent::k, Finish::gate>(across_rows<H, Word>(rows, H, W2T_.data()), words,
                                           along_rows<H, Word>(d2, n, d2_rows_.data()), words, n, nullptr,
                                           h1_.data());

    const Word* d1 = across_rows<H, Word>(h1_.data(), n, d1_slots_.data());
    const auto gradient_of_W1 = [&](auto& pieces, const auto& inputs_of, std::ptrdiff_t stride) {
        for (std::size_t j = 0; j < blocks.size(); ++j) pieces[j] = inputs_of(blocks[j]);
        multiply<H, Adjacent::n, Finish::plain, Word>(
            d1, std::span<const Word* const>(pieces.data(), blocks.size()), PoseBlocks::block / packed<Word>,
            stride, shape_.inputs, nullptr, g + shape_.W1());
    };
    if constexpr (std::is_same_v<Word, float>)
        gradient_of_W1(
            pieces_, [&](int b) { return poses_->rows(b); }, poses_->stride());
    else
        gradient_of_W1(
            paired_pieces_, [&](int b) { return poses_->paired_slots(b); }, poses_->paired_stride());
    add_rows<H>(h1_.data(), n, g + shape_.b1());
}

float MlpBatch::loss(const Eigen::VectorXf& weights, std::span<const int> blocks) noexcept {
    return with_kernel(shape_.hidden, Arithmetic::single,
                       [&]<int H, class Word>() { return forward<H, Word>(weights.data(), blocks); });
}

float MlpBatch::loss_and_gradient(const Eigen::VectorXf& weights, std::span<const int> blocks,
                                  Eigen::VectorXf& gradient) noexcept {
    return with_kernel(shape_.hidden, poses_->arithmetic(), [&]<int H, class Word>() {
        const float loss = forward<H, Word>(weights.data(), blocks);
        backward<H, Word>(weights.data(), blocks, gradient.data());
        return loss;
    });
}

}  // namespace nbd
