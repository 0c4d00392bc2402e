#include "sim/factor/packed_factor.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

constexpr int lanes = 16;    // rows are padded to whole vectors of this many floats
constexpr int together = 4;  // columns that share one pass over the rows
constexpr float largest = 32767;
constexpr int shares = 8;  // number of branches

using Floats [[gnu::vector_size(lanes * sizeof(float))]] = float;
using Shorts [[gnu::vector_size(lanes * sizeof(std::int16_t))]] = std::int16_t;

Floats load(const std::int16_t* values) noexcept {
    Shorts shorts;
    std::memcpy(&shorts, values, sizeof shorts);
    return __builtin_convertvector(shorts, Floats);
}

Floats load(const float* values) noexcept {
    Floats floats;
    std::memcpy(&floats, values, sizeof floats);
    return floats;
}

/// Adds t[0] * column 0 + t[1] * column 1 + ... to sum, for `count` columns.
template <int count>
void add_columns(const std::int16_t* column, std::ptrdiff_t stride, const float* t, float* sum) noexcept {
    for (std::ptrdiff_t k = 0; k < stride; k += lanes) {
        Floats total = load(sum + k);
        for (int c = 0; c < count; ++c) total += t[c] * load(column + c * stride + k);
        std::memcpy(sum + k, &total, sizeof total);
    }
}

/// Sets out[c] = scale[c] * dot(column c, z) for `count` columns.
template <int count>
void dot_columns(const std::int16_t* column, std::ptrdiff_t stride, const float* z, const float* scale,
                 float* out) noexcept {
    Floats part[count] = {};
    for (std::ptrdiff_t k = 0; k < stride; k += lanes) {
        const Floats rows = load(z + k);
        for (int c = 0; c < count; ++c) part[c] += load(column + c * stride + k) * rows;
    }
    for (int c = 0; c < count; ++c) {
        float sum = 0;
        for (int l = 0; l < lanes; ++l) sum += part[c][l];
        out[c] = scale[c] * sum;
    }
}

}  // namespace

/// Returns the branch of each supernode; -1 for the trunk. The heaviest branch is cut at its root until no
/// branch exceeds its share of the work; then the branches are combined into `shares` groups.
std::vector<int> PackedFactor::cut(const SupernodalFactor& factor) {
    const int count = static_cast<int>(factor.first_column.size()) - 1;
    std::vector<int> supernode_of(factor.permutation.size()), first(count);
    std::vector<std::vector<int>> children(count);
    std::vector<double> work(count);  // work of the supernode and its whole subtree
    for (int s = 0; s < count; ++s)
        for (int c = factor.first_column[s]; c < factor.first_column[s + 1]; ++c) supernode_of[c] = s;
    std::vector<int> open;
    for (int s = 0; s < count; ++s) {
        const int width = factor.first_column[s + 1] - factor.first_column[s],
                  height = factor.first_row[s + 1] - factor.first_row[s];
        work[s] += static_cast<double>(width) * height;
        if (height == width) {
            open.push_back(s);
            continue;
        }
        const int parent = supernode_of[factor.rows[factor.first_row[s] + width]];
        children[parent].push_back(s);
        work[parent] += work[s];
    }
    double total = 0;
    for (const int s : open) total += work[s];
    std::vector<int> branch(count, -1);
    while (!open.empty()) {
        const auto heaviest = std::ranges::max_element(open, {}, [&](int s) { return work[s]; });
        if (work[*heaviest] <= total / shares) break;
        const std::vector<int>& cut_off = children[*heaviest];
        open.erase(heaviest);
        open.insert(open.end(), cut_off.begin(), cut_off.end());
    }
    std::ranges::stable_sort(open, std::greater{}, [&](int s) { return work[s]; });
    std::array<double, shares> load{};
    for (const int root : open) {
        const auto lightest = std::ranges::min_element(load);
        *lightest += work[root];
        std::vector<int> below{root};
        while (!below.empty()) {
            const int s = below.back();
            below.pop_back();
            branch[s] = static_cast<int>(lightest - load.begin());
            below.insert(below.end(), children[s].begin(), children[s].end());
        }
    }
    return branch;
}

PackedFactor::PackedFactor(const SupernodalFactor& factor)
    : size_(static_cast<int>(factor.permutation.size())), scale_(factor.permutation.size()) {
    const std::vector<int> branch = cut(factor);
    std::vector<int> sequence, place(factor.permutation.size());  // supernodes in order; places of columns
    for (int part = 0; part <= shares; ++part) {
        Branch range{.begin = static_cast<int>(sequence.size())};
        for (int s = 0; s < static_cast<int>(branch.size()); ++s)
            if (branch[s] == (part < shares ? part : -1)) sequence.push_back(s);
        range.end = static_cast<int>(sequence.size());
        if (part < shares)
            branches_.push_back(range);
        else
            trunk_ = range;
    }
    for (std::size_t k = 0; k < sequence.size(); ++k) {
        if (static_cast<int>(k) == trunk_.begin) trunk_first_ = static_cast<int>(order_.size());
        for (int c = factor.first_column[sequence[k]]; c < factor.first_column[sequence[k] + 1]; ++c) {
            place[c] = static_cast<int>(order_.size());
            order_.push_back(factor.permutation[c]);
        }
    }
    if (trunk_.begin == trunk_.end) trunk_first_ = size_;
    for (const int s : sequence) pack(factor, static_cast<std::size_t>(s), place);
}

void PackedFactor::pack(const SupernodalFactor& factor, std::size_t s, const std::vector<int>& place) {
    Supernode node;
    node.width = factor.first_column[s + 1] - factor.first_column[s];
    node.first = place[factor.first_column[s]];
    const int height = factor.first_row[s + 1] - factor.first_row[s];
    node.below = height - node.width;
    node.stride = (height + lanes - 1) / lanes * lanes;
    node.rows = static_cast<int>(rows_.size());
    node.values = values_.size();
    longest_ = std::max(longest_, node.stride);
    for (int k = factor.first_row[s] + node.width; k < factor.first_row[s + 1]; ++k) {
        const int row = place[factor.rows[k]];
        node.inside += row < trunk_first_;
        rows_.push_back(row);
    }
    const Eigen::Map<const Eigen::MatrixXd> L(factor.values.data() + factor.first_value[s], height,
                                              node.width);
    Eigen::MatrixXd M(height, node.width);
    M.topRows(node.width).setIdentity();
    L.topRows(node.width).triangularView<Eigen::Lower>().solveInPlace(M.topRows(node.width));
    M.bottomRows(node.below).noalias() = L.bottomRows(node.below) * M.topRows(node.width);
    values_.resize(node.values +
                   static_cast<std::size_t>(node.stride) * static_cast<std::size_t>(node.width));
    for (int c = 0; c < node.width; ++c) {
        const double scale = M.col(c).cwiseAbs().maxCoeff() / largest;
        scale_[node.first + c] = static_cast<float>(scale);
        std::int16_t* column = values_.data() + node.values + static_cast<std::ptrdiff_t>(node.stride) * c;
        for (int k = 0; k < height; ++k) column[k] = static_cast<std::int16_t>(std::lround(M(k, c) / scale));
    }
    nodes_.push_back(node);
}

std::size_t PackedFactor::bytes() const noexcept {
    return values_.size() * sizeof(std::int16_t) + rows_.size() * sizeof(int) +
           order_.size() * (sizeof(int) + sizeof(float)) + nodes_.size() * sizeof(Supernode);
}

/// trunk: accumulates the updates to the trunk's rows.
void PackedFactor::forward(const Supernode& node, float* y, float* trunk, float* sum) const noexcept {
    float* own = y + node.first;
    const float* scale = scale_.data() + node.first;
    const std::ptrdiff_t stride = node.stride;
    const std::int16_t* column = values_.data() + node.values;
    std::fill(sum, sum + stride, 0.0F);
    int c = 0;
    for (; c + together <= node.width; c += together, column += together * stride) {
        float t[together];
        for (int k = 0; k < together; ++k) t[k] = own[c + k] * scale[c + k];
        add_columns<together>(column, stride, t, sum);
    }
    for (; c < node.width; ++c, column += stride) {
        const float t = own[c] * scale[c];
        add_columns<1>(column, stride, &t, sum);
    }
    std::copy(sum, sum + node.width, own);
    const int* row = rows_.data() + node.rows;
    const float* below = sum + node.width;
    for (int k = 0; k < node.inside; ++k) y[row[k]] -= below[k];
    for (int k = node.inside; k < node.below; ++k) trunk[row[k] - trunk_first_] -= below[k];
}

void PackedFactor::backward(const Supernode& node, float* y, float* gathered) const noexcept {
    float* own = y + node.first;
    const float* scale = scale_.data() + node.first;
    const std::ptrdiff_t stride = node.stride;
    const int* row = rows_.data() + node.rows;
    std::copy(own, own + node.width, gathered);
    for (int k = 0; k < node.below; ++k) gathered[node.width + k] = -y[row[k]];
    std::fill(gathered + node.width + node.below, gathered + stride, 0.0F);
    const std::int16_t* column = values_.data() + node.values;
    int c = 0;
    for (; c + together <= node.width; c += together, column += together * stride)
        dot_columns<together>(column, stride, gathered, scale + c, own + c);
    for (; c < node.width; ++c, column += stride)
        dot_columns<1>(column, stride, gathered, scale + c, own + c);
}

void PackedFactor::solve(std::span<float> y, std::vector<float>& work) const {
    const int trunk_size = size_ - trunk_first_, stride = trunk_size + longest_;
    float* trunk = y.data() + trunk_first_;
    work.assign(static_cast<std::size_t>(stride) * (shares + 1), 0.0F);
    const auto own_work = [&](int part) { return work.data() + static_cast<std::ptrdiff_t>(stride) * part; };
    const auto eliminate = [&](Branch range, float* losses, float* scratch) {
        for (int s = range.begin; s < range.end; ++s) forward(nodes_[s], y.data(), losses, scratch);
    };
    const auto substitute = [&](Branch range, float* scratch) {
        for (int s = range.end; s-- > range.begin;) backward(nodes_[s], y.data(), scratch);
    };
    parallel_for(
        shares, [&](int part) { eliminate(branches_[part], own_work(part), own_work(part) + trunk_size); },
        1);
    for (int part = 0; part < shares; ++part)
        for (int k = 0; k < trunk_size; ++k) trunk[k] += own_work(part)[k];
    eliminate(trunk_, trunk, own_work(shares));
    substitute(trunk_, own_work(shares));
    parallel_for(
        shares, [&](int part) { substitute(branches_[part], own_work(part)); }, 1);
}

}  // namespace nbd
