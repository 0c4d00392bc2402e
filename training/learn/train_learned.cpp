#include "training/learn/train_learned.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "collision/base/counter_random.hpp"
#include "collision/base/stop.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "meshing/progress/progress.hpp"

namespace nbd {

namespace {

constexpr std::size_t pose_bytes = std::size_t{512} << 20;

/// Builds a model with samples and the weights of the centres; reach and ranges are 0.
LearnedModel make_model(const std::vector<NodeSamples>& nodes, bool network) {
    LearnedModel model;
    model.network = network;
    model.boxes.resize(nodes.size());
    for (const NodeSamples& node : nodes) {
        const int count = static_cast<int>(node.vertices.size());
        const auto begin = model.values.size();
        model.nodes.push_back(
            {static_cast<int>(model.samples.size()), count, static_cast<int>(begin), node.exact});
        model.samples.insert(model.samples.end(), node.vertices.begin(), node.vertices.end());
        model.values.resize(begin + static_cast<std::size_t>(LearnedModel::block_size(count, network)));
        std::copy_n(node.weights.data(), count, model.values.begin() + static_cast<std::ptrdiff_t>(begin));
    }
    return model;
}

/// Means and inverse deviations of the samples' squared distances in training. Deviations are at least 0.3 %
/// of the mean, so that rounding does not count as out of distribution.
void fit_range(const SampleReach& reach, const LearnedModel::Node& node, float* values) {
    for (int k = 0; k < node.sample_count; ++k) {
        const double mean = reach.squared_mean[node.sample_begin + k],
                     deviation = reach.squared_deviation[node.sample_begin + k];
        values[k] = static_cast<float>(mean);
        values[node.sample_count + k] = static_cast<float>(
            1 / std::max({deviation, 0.003 * mean, double{std::numeric_limits<float>::min()}}));
    }
}

}  // namespace

std::vector<Vertices> some_poses(FrameSource& source, std::span<const FrameId> frames, int most) {
    const auto bytes =
        static_cast<std::size_t>(std::max<Eigen::Index>(3 * source.W().rows(), 1)) * sizeof(float);
    const auto fit = static_cast<int>(std::clamp<std::size_t>(pose_bytes / bytes, 1, 1'000'000));
    const std::vector<FrameId> chosen = spread(frames, std::min(most, fit));
    std::vector<Vertices> poses(chosen.size());
    source.for_each_frame(chosen,
                          [&](int, int index, VerticesRef x) { poses[static_cast<std::size_t>(index)] = x; });
    return poses;
}

float upper_quantile(Eigen::VectorXf numbers, double miss_rate) {
    const auto above = static_cast<Eigen::Index>(miss_rate * static_cast<double>(numbers.size()));
    float* nth = numbers.data() + numbers.size() - 1 - std::min(above, numbers.size() - 1);
    std::nth_element(numbers.data(), nth, numbers.data() + numbers.size());
    return *nth;
}

BoxFit fit_box(const Eigen::VectorXf& spread, Eigen::VectorXf growths, double miss_rate) {
    const Eigen::ArrayXd squared = spread.cast<double>().array().square();
    const double mean = squared.mean(), deviation = std::sqrt((squared - mean).square().mean());
    const double least = std::max(0.003 * mean, double{std::numeric_limits<float>::min()});
    return {std::max(0.f, upper_quantile(std::move(growths), miss_rate)), static_cast<float>(mean),
            static_cast<float>(1 / std::max(deviation, least))};
}

void check_learned_config(const LearnedConfig& config) {
    check_samples_config(config.samples);
    check_network_config(config.networks);
    if (config.networks.hidden != LearnedModel::hidden)
        throw std::invalid_argument(fmt::format("radius networks {} wide; allowed: {}",
                                                config.networks.hidden, LearnedModel::hidden));
    if (config.sample_poses < 1)
        throw std::invalid_argument(
            fmt::format("{} poses to choose samples from, at least 1 needed", config.sample_poses));
    if (!(config.box_miss_rate >= 0 && config.box_miss_rate < 1))
        throw std::invalid_argument(
            fmt::format("miss rate of boxes {}; allowed: [0, 1)", config.box_miss_rate));
}

LearnedModel choose_samples(const SurfaceBody& body, const SphereTree& tree, FrameSource& source,
                            std::span<const FrameId> frames, const LearnedConfig& config) {
    check_learned_config(config);
    if (frames.empty()) throw std::invalid_argument("no pose to choose samples from");
    SamplesConfig samples = config.samples;
    samples.seed = counter_random(config.seed, 0, 0);
    const std::vector<Vertices> poses = some_poses(source, frames, config.sample_poses);
    std::vector<NodeSamples> nodes(tree.nodes.size());
    std::atomic<int> chosen = 0;
    parallel_for(
        static_cast<int>(nodes.size()),
        [&](int i) {
            stop_if_asked();
            nodes[static_cast<std::size_t>(i)] =
                choose_samples(body.X, poses, tree.node_vertices(i), samples);
            tell_progress("nodes", ++chosen, static_cast<double>(nodes.size()));
        },
        1);
    return make_model(nodes, config.network);
}

void fit_sample_reach(const SampleReach& reach, const LearnedConfig& config, LearnedModel& model) {
    RadiusNetworkConfig networks = config.networks;
    networks.seed = counter_random(config.seed, 1, 0);
    parallel_for(
        static_cast<int>(model.nodes.size()),
        [&](int i) {
            stop_if_asked();
            const LearnedModel::Node& node = model.nodes[static_cast<std::size_t>(i)];
            float* block = model.values.data() + node.value_begin;
            fit_range(reach, node, block + node.sample_count);
            model.boxes[static_cast<std::size_t>(i)] =
                fit_box(reach.spread.col(i), reach.box.col(i), config.box_miss_rate);
            if (node.exact) return;
            const Eigen::VectorXf growth = reach.growth.col(i);
            float* last =
                block + LearnedModel::block_size(node.sample_count, model.network) - LearnedModel::lanes;
            LearnedModel::Reach fitted{.growth = static_cast<float>(growth.cast<double>().mean()),
                                       .low = 0,
                                       .high = growth.maxCoeff()};
            if (model.network) {
                const Eigen::VectorXf weights =
                    train_radius_network(reach.samples[static_cast<std::size_t>(i)], growth, networks,
                                         static_cast<std::uint64_t>(i))
                        .weights;
                std::copy_n(weights.data(), weights.size() - 1, block + 3 * node.sample_count);
                fitted.growth = weights[weights.size() - 1];
            }
            last[0] = fitted.growth, last[1] = fitted.low, last[2] = fitted.high;
        },
        1);
}

LearnedModel train_learned(const SurfaceBody& body, const SphereTree& tree, FrameSource& source,
                           std::span<const FrameId> frames, const LearnedConfig& config,
                           const std::function<void(std::string_view)>& stage) {
    if (stage) stage("choosing samples");
    LearnedModel model = choose_samples(body, tree, source, frames, config);
    if (stage) stage("fitting learned bounds");
    fit_sample_reach(
        measure_reach(tree, model, source, frames, counter_random(config.seed, 2, 0), config.network), config,
        model);
    return model;
}

}  // namespace nbd
