#include "collision/bounds/learned/learned_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "collision/base/requirement.hpp"

namespace nbd {
namespace {

constexpr int lanes = LearnedModel::lanes;
using Lanes = Eigen::Array<float, lanes, 1>;
using LanesMap = Eigen::Map<const Lanes>;
static_assert(LearnedModel::hidden == lanes);

/// Positions of a node's samples in groups of four, which fit the registers of every CPU.
struct Samples {
    struct Four {
        Eigen::Array4f x, y, z;
    };
    Four fours[LearnedModel::max_samples / 4];
    Eigen::Array4f first;  // position of the first sample
    int count;

    Samples(const LearnedModel& model, const LearnedModel::Node& node, const Positions& pose) noexcept
        : first(pose[model.samples[static_cast<std::size_t>(node.sample_begin)]]),
          count(node.sample_count / 4) {
        const int* row = model.samples.data() + node.sample_begin;
        for (int f = 0; f < count; ++f) {
            Eigen::Array44f positions;
            for (int k = 0; k < 4; ++k) positions.col(k) = pose[*row++];
            const Eigen::Array44f by_axis = positions.transpose();
            fours[f] = {by_axis.col(0), by_axis.col(1), by_axis.col(2)};
        }
    }
};
using FourMap = Eigen::Map<const Eigen::Array4f>;

Eigen::Vector3f centre(const Samples& samples, const float* weights) noexcept {
    // Offsets from the first sample keep their digits far from the origin.
    const float x0 = samples.first[0], y0 = samples.first[1], z0 = samples.first[2];
    Eigen::Array4f x = Eigen::Array4f::Zero(), y = x, z = x;
    for (int f = 0; f < samples.count; ++f) {
        const Samples::Four& four = samples.fours[f];
        const FourMap w(weights + 4 * f);
        x += w * (four.x - x0);
        y += w * (four.y - y0);
        z += w * (four.z - z0);
    }
    return {x0 + x.sum(), y0 + y.sum(), z0 + z.sum()};
}

/// Returns b + W x, with W [16, in], and moves `values` past both.
Lanes dense_layer(const float*& values, const float* x, int in) noexcept {
    const float* W = values;
    values += lanes * (in + 1);
    // Four independent sums, since each addition waits for the previous one.
    Lanes sums[4] = {LanesMap(W + lanes * in), Lanes::Zero(), Lanes::Zero(), Lanes::Zero()};
    for (int i = 0; i < in; i += 4)
        for (int j = 0; j < 4; ++j) sums[j] += LanesMap(W + (i + j) * lanes) * x[i + j];
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

float network(const float* values, const float* distances, int count) noexcept {
    const Lanes h1 = dense_layer(values, distances, count).max(0.f);
    const Lanes h2 = dense_layer(values, h1.data(), lanes).max(0.f);
    return (LanesMap(values) * h2).sum();
}

void check_node(const LearnedModel& model, int i, int sample_begin, int value_begin) {
    constexpr Requirement require("learned bounds");
    const LearnedModel::Node& node = model.nodes[static_cast<std::size_t>(i)];
    require(node.sample_count >= lanes && node.sample_count <= LearnedModel::max_samples &&
                node.sample_count % lanes == 0,
            "node ", i, " has ", node.sample_count, " samples, allowed: multiples of ", lanes, " up to ",
            LearnedModel::max_samples);
    require(node.sample_begin == sample_begin && node.value_begin == value_begin, "node ", i,
            " begins at sample ", node.sample_begin, " and value ", node.value_begin, " instead of ",
            sample_begin, " and ", value_begin);
}

void check_numbers(const LearnedModel& model, int i) {
    constexpr Requirement require("learned bounds");
    const LearnedModel::Node& node = model.nodes[static_cast<std::size_t>(i)];
    const float* block = model.values.data() + node.value_begin;
    const int size = LearnedModel::block_size(node.sample_count, model.network);
    require(std::all_of(block, block + size, [](float v) { return std::isfinite(v); }), "a number of node ",
            i, " is not finite");
    const float sum = Eigen::Map<const Eigen::VectorXf>(block, node.sample_count).sum();
    require(std::abs(sum - 1) < 1e-3f, "the weights of the centre of node ", i, " sum to ", sum,
            " instead of 1");
    const float* inverse_deviation = block + 2 * node.sample_count;
    require(
        std::all_of(inverse_deviation, inverse_deviation + node.sample_count, [](float v) { return v >= 0; }),
        "an inverse deviation of node ", i, " is negative");
    const LearnedModel::Reach reach = model.reach(i);
    require(reach.low >= 0 && reach.low <= reach.high, "the reach of node ", i, " is ", reach.low, " to ",
            reach.high, ", allowed: an ascending range from 0 or more");
    if (model.boxes.empty()) return;
    const BoxFit& fit = model.boxes[static_cast<std::size_t>(i)];
    for (const float number : {fit.growth, fit.mean, fit.inverse_deviation})
        require(number >= 0 && std::isfinite(number), "the box of node ", i, " has a number ", number,
                ", allowed: finite, 0 or more");
}

}  // namespace

LearnedSphere learned_sphere(const LearnedModel& model, int node, const Positions& pose) noexcept {
    const LearnedModel::Node& n = model.nodes[static_cast<std::size_t>(node)];
    const float* weights = model.values.data() + n.value_begin;
    const float *mean = weights + n.sample_count, *inverse_deviation = mean + n.sample_count;
    const Samples samples(model, n, pose);
    const Eigen::Vector3f c = centre(samples, weights);

    Eigen::Array4f squared[LearnedModel::max_samples / 4], most = Eigen::Array4f::Zero(), ood_score = most;
    for (int f = 0; f < samples.count; ++f) {
        const Samples::Four& four = samples.fours[f];
        squared[f] = (four.x - c[0]).square() + (four.y - c[1]).square() + (four.z - c[2]).square();
        most = most.max(squared[f]);
        ood_score =
            ood_score.max((squared[f] - FourMap(mean + 4 * f)).abs() * FourMap(inverse_deviation + 4 * f));
    }
    // Each difference, square and sum rounds by half an ulp: 4 ulp cover them all.
    constexpr float slack = 1 + 4 * std::numeric_limits<float>::epsilon();
    const float distance = std::sqrt(most.maxCoeff()) * slack;
    // Vector maxima may lose NaN; a sum does not.
    const float known = n.exact ? 0 : ood_score.maxCoeff();
    const float score = c.allFinite() ? known : std::numeric_limits<float>::quiet_NaN();
    const LearnedModel::Reach reach = model.reach(node);
    if (!model.network || n.exact) return {{c, distance + reach.growth}, score};
    float distances[LearnedModel::max_samples];
    for (int f = 0; f < samples.count; ++f) Eigen::Map<Eigen::Array4f>(distances + 4 * f) = squared[f].sqrt();
    const float growth =
        reach.growth + network(inverse_deviation + n.sample_count, distances, n.sample_count);
    return {{c, distance + std::clamp(growth, reach.low, reach.high)}, score};
}

void check_learned_model(const LearnedModel& model, const SphereTree& tree, int vertex_count) {
    constexpr Requirement require("learned bounds");
    require(model.nodes.size() == tree.nodes.size(), "has ", model.nodes.size(), " nodes, but the tree has ",
            tree.nodes.size());
    for (const int v : model.samples)
        require(v >= 0 && v < vertex_count, "sample vertex ", v, ", but the surface has ", vertex_count,
                " vertices");
    int samples = 0, values = 0;
    for (int i = 0; i < static_cast<int>(model.nodes.size()); ++i) {
        check_node(model, i, samples, values);
        const int count = model.nodes[static_cast<std::size_t>(i)].sample_count;
        samples += count;
        values += LearnedModel::block_size(count, model.network);
    }
    require(model.boxes.empty() || model.boxes.size() == model.nodes.size(), "has boxes of ",
            model.boxes.size(), " nodes instead of ", model.nodes.size(), " or none");
    require(model.samples.size() == static_cast<std::size_t>(samples) &&
                model.values.size() == static_cast<std::size_t>(values),
            "has ", model.samples.size(), " samples and ", model.values.size(), " numbers instead of ",
            samples, " and ", values);
    for (int i = 0; i < static_cast<int>(model.nodes.size()); ++i) check_numbers(model, i);
}

}  // namespace nbd
