#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <vector>

#include "training/networks/mlp.hpp"
#include "training/networks/pose_blocks.hpp"

namespace nbd {

/// How a network is trained: mean squared error, Adam with decaying weights, random batches, a learning rate
/// that falls on plateaus. Converged means that the rate fell below its floor.
struct MlpConfig {
    int hidden = 32;                  // 16, 32 or 64
    int batch = 128;                  // poses a step, rounded up to whole blocks of 16
    double learning_rate = 5e-3;      // at the start
    double min_learning_rate = 2e-5;  // training ends below it
    double weight_decay = 0.1;        // share of the rate by which weights shrink in a step; the paper: 0
    double decay = 0.5;               // factor on the rate at a plateau
    int patience = 20;                // epochs without an improvement that make a plateau
    double improvement = 1e-2;        // relative fall of an epoch's mean loss that counts as one
    int max_epochs = 600;             // training ends here in any case
    std::uint64_t seed = 1;           // of initial weights and shuffles
    /// Of the steps.
    Arithmetic arithmetic = has_arithmetic(Arithmetic::mixed) ? Arithmetic::mixed : Arithmetic::single;
};

/// Throws std::invalid_argument naming the option that is out of range.
void check_mlp_config(const MlpConfig& config);

struct TrainedMlp {
    Eigen::VectorXf weights;  // as in MlpShape; empty: not trained yet
    float loss = 0;           // over all poses with these weights
    int epochs = 0;
};

/// Trains one network. poses: its inputs; targets: [poses, 4]; both about within [-1, 1].
/// stream: tells the random numbers of this network from those of others, usually the node.
/// Same bits for the same arguments. Nothing when `cancel` became true meanwhile.
std::optional<TrainedMlp> train_mlp(const PoseBlocks& poses, const PoseRows& targets, const MlpConfig& config,
                                    std::uint64_t stream, const std::atomic<bool>* cancel = nullptr);

struct TrainingProgress {
    int nodes_done = 0, nodes = 0;
    double mean_loss = 0;     // of the nodes done
    double seconds = 0;       // since training began
    double seconds_left = 0;  // estimate
};

/// How the caller follows and stops a training. Calls come one at a time, from any thread.
struct TrainingHooks {
    std::function<void(const TrainingProgress&)> progress{};  // after every node
    const std::atomic<bool>* cancel = nullptr;                // true: stop at the next epoch
};

/// Training stopped because its caller asked for it.
struct TrainingCancelled : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Trains one network a node, nodes in parallel; each node's result depends on its data, `config` and its
/// number alone, so any number of threads and any interruption give the same bits.
/// inputs: [poses, m]; targets: [poses, 4 nodes], four columns a node. networks: one a node; those that have
/// weights are kept as they are, the others are trained. node_done: called after each node trained, one call
/// at a time, with `networks` fit to be read: what a checkpoint needs; may be empty.
/// Throws std::invalid_argument on a bad config or shapes that do not fit, TrainingCancelled.
void train_mlps(const PoseRows& inputs, const PoseRows& targets, const MlpConfig& config,
                const TrainingHooks& hooks, const std::function<void()>& node_done,
                std::vector<TrainedMlp>& networks);

}  // namespace nbd
