#include "training/networks/mlp_trainer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <mutex>
#include <numeric>

#include "collision/base/stopwatch.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "training/networks/adam.hpp"

namespace nbd {

namespace {

template <class... Args>
[[noreturn]] void fail(fmt::format_string<Args...> text, Args&&... args) {
    throw std::invalid_argument(fmt::format(text, std::forward<Args>(args)...));
}

/// Learning rate, multiplied by `decay` when the loss has not improved for more than `patience` epochs.
class PlateauDecay {
 public:
    explicit PlateauDecay(const MlpConfig& config) : config_(config), rate_(config.learning_rate) {}

    double rate() const noexcept { return rate_; }
    bool converged() const noexcept { return rate_ < config_.min_learning_rate; }

    void epoch_done(double loss) noexcept {
        if (loss < best_ * (1 - config_.improvement)) {
            best_ = loss;
            idle_ = 0;
        } else if (++idle_ > config_.patience) {
            rate_ *= config_.decay;
            idle_ = 0;
        }
    }

 private:
    const MlpConfig& config_;
    double rate_, best_ = std::numeric_limits<double>::infinity();
    int idle_ = 0;  // epochs since the last improvement
};

}  // namespace

void check_mlp_config(const MlpConfig& c) {
    check_mlp_shape({.hidden = c.hidden});
    if (c.batch < 1) fail("batch of {} poses, at least 1 needed", c.batch);
    if (!(c.learning_rate > 0 && c.learning_rate <= 1))
        fail("learning rate {}; allowed: (0, 1]", c.learning_rate);
    if (!(c.min_learning_rate > 0 && c.min_learning_rate <= c.learning_rate))
        fail("lowest learning rate {}; allowed: (0, {}]", c.min_learning_rate, c.learning_rate);
    if (!(c.weight_decay >= 0 && c.weight_decay <= 1))
        fail("weight decay {}; allowed: [0, 1]", c.weight_decay);
    if (!(c.decay > 0 && c.decay < 1)) fail("learning rate decay {}; allowed: (0, 1)", c.decay);
    if (c.patience < 0) fail("patience of {} epochs, at least 0 needed", c.patience);
    if (!(c.improvement >= 0 && c.improvement < 1)) fail("improvement {}; allowed: [0, 1)", c.improvement);
    if (!has_arithmetic(c.arithmetic))
        fail("this program was built without {} arithmetic", name(c.arithmetic));
    if (c.max_epochs < 1) fail("epoch limit {}, at least 1 needed", c.max_epochs);
}

std::optional<TrainedMlp> train_mlp(const PoseBlocks& poses, const PoseRows& targets, const MlpConfig& config,
                                    std::uint64_t stream, const std::function<bool()>& cancel) {
    std::vector<int> order(poses.blocks());
    std::iota(order.begin(), order.end(), 0);
    const int a_step = std::min((config.batch + PoseBlocks::block - 1) / PoseBlocks::block, poses.blocks());
    MlpBatch batch(config.hidden, poses, targets, a_step);
    TrainedMlp result{.weights = initial_weights(batch.shape(), config.seed, stream)};
    Adam adam(batch.shape().weights(), config.weight_decay);
    PlateauDecay decay(config);
    Eigen::VectorXf gradient(batch.shape().weights());
    /// Mean of f(blocks) over consecutive steps, weighted by their number of poses.
    const auto mean_over_steps = [&](const auto& f) {
        double sum = 0;
        for (int begin = 0; begin < poses.blocks(); begin += a_step) {
            const auto blocks =
                std::span<const int>(order).subspan(begin, std::min(a_step, poses.blocks() - begin));
            sum += static_cast<double>(f(blocks)) * poses.poses_in(blocks);
        }
        return sum / poses.poses();
    };

    while (!decay.converged() && result.epochs < config.max_epochs) {
        if (cancel && cancel()) return std::nullopt;
        shuffle(order, config.seed, stream, result.epochs++);
        decay.epoch_done(mean_over_steps([&](std::span<const int> blocks) {
            const float loss = batch.loss_and_gradient(result.weights, blocks, gradient);
            adam.step(gradient, decay.rate(), result.weights);
            return loss;
        }));
    }
    result.loss = static_cast<float>(
        mean_over_steps([&](std::span<const int> blocks) { return batch.loss(result.weights, blocks); }));
    return result;
}

void train_mlps(const PoseRows& inputs, const PoseRows& targets, const MlpConfig& config,
                const TrainingHooks& hooks, const std::function<void()>& node_done,
                std::vector<TrainedMlp>& networks) {
    check_mlp_config(config);
    const MlpShape shape{.inputs = static_cast<int>(inputs.cols()), .hidden = config.hidden};
    check_mlp_shape(shape);
    const int nodes = networks.size();
    if (inputs.rows() < 1) fail("no pose to train on");
    if (targets.rows() != inputs.rows() || targets.cols() != MlpShape::outputs * nodes)
        fail("targets are {} x {}, but {} poses and {} nodes need {} x {}", targets.rows(), targets.cols(),
             inputs.rows(), nodes, inputs.rows(), MlpShape::outputs * nodes);
    std::vector<int> missing;
    TrainingProgress progress{.nodes = nodes};
    double loss_sum = 0;
    for (int i = 0; i < nodes; ++i) {
        const TrainedMlp& network = networks[i];
        if (network.weights.size() == 0) {
            missing.push_back(i);
        } else if (network.weights.size() != shape.weights()) {
            fail("node {} has {} weights, but its network needs {}", i, network.weights.size(),
                 shape.weights());
        } else {
            ++progress.nodes_done;
            loss_sum += network.loss;
        }
    }

    const Stopwatch watch;
    const int resumed = progress.nodes_done;
    const PoseBlocks poses(inputs, config.arithmetic, config.seed);
    std::mutex report;
    parallel_for(
        missing.size(),
        [&](int task) {
            const int node = missing[task];
            const PoseRows own = targets.middleCols(MlpShape::outputs * node, MlpShape::outputs);
            auto network = train_mlp(poses, own, config, node, hooks.cancel);
            if (!network) return;
            const std::lock_guard lock(report);
            loss_sum += network->loss;
            networks[node] = std::move(*network);
            ++progress.nodes_done;
            progress.mean_loss = loss_sum / progress.nodes_done;
            progress.seconds = watch.seconds();
            progress.seconds_left =
                progress.seconds / (progress.nodes_done - resumed) * (nodes - progress.nodes_done);
            if (node_done) node_done();
            if (hooks.progress) hooks.progress(progress);
        },
        1);
    if (progress.nodes_done < nodes)
        throw TrainingCancelled(
            fmt::format("training was stopped after {} of {} nodes", progress.nodes_done, nodes));
}

}  // namespace nbd
