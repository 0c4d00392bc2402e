#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <vector>

#include "training/networks/mlp.hpp"
#include "training/networks/pose_blocks.hpp"

namespace nbd {

/// Options of a network's training: mean squared error, Adam with weight decay, random batches, a learning
/// rate that falls on plateaus. Training has converged once the rate is below min_learning_rate.
struct MlpConfig {
    int hidden = 32;                  // 16, 32 or 64
    int batch = 128;                  // poses per step, rounded up to whole blocks of 16
    double learning_rate = 5e-3;      // at the start
    double min_learning_rate = 2e-5;  // training ends below it
    double weight_decay = 0.1;        // see Adam; the paper: 0
    double decay = 0.5;               // factor on the rate at a plateau
    int patience = 20;                // epochs without improvement before the rate falls
    double improvement = 1e-2;  // least relative fall of an epoch's mean loss that counts as improvement
    int max_epochs = 600;       // upper limit
    std::uint64_t seed = 1;     // of initial weights and shuffles
    /// Arithmetic of the training steps.
    Arithmetic arithmetic = has_arithmetic(Arithmetic::mixed) ? Arithmetic::mixed : Arithmetic::single;
};

/// Throws std::invalid_argument naming the option that is out of range.
void check_mlp_config(const MlpConfig& config);

struct TrainedMlp {
    Eigen::VectorXf weights;  // as in MlpShape; empty if not trained yet
    float loss = 0;           // mean squared error over all poses with these weights
    int epochs = 0;
};

/// Trains one network. poses: inputs; targets: [poses, 4]; both roughly within [-1, 1].
/// stream: selects this network's random numbers, usually the node.
/// cancel: whether to stop, asked before every epoch. Same bits for the same arguments. Returns nullopt if
/// it was stopped.
std::optional<TrainedMlp> train_mlp(const PoseBlocks& poses, const PoseRows& targets, const MlpConfig& config,
                                    std::uint64_t stream, const std::function<bool()>& cancel = {});

struct TrainingProgress {
    int nodes_done = 0, nodes = 0;
    double mean_loss = 0;     // over the nodes done
    double seconds = 0;       // since training began
    double seconds_left = 0;  // estimate
};

/// Lets the caller follow and stop a training. Calls come one at a time, from any thread.
struct TrainingHooks {
    std::function<void(const TrainingProgress&)> progress{};  // after every node
    std::function<bool()> cancel{};                           // from any thread; true: stop at the next epoch
};

/// Thrown when the caller stops the training.
struct TrainingCancelled : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Trains one network per node, nodes in parallel. A node's result depends on its data, `config` and its
/// number alone, so any number of threads and any interruption give the same bits.
/// inputs: [poses, m]. targets: [poses, 4 nodes], four columns per node. networks: one per node; those with
/// weights are kept, the others are trained. node_done: called after each trained node, one call at a time,
/// while `networks` can be read safely (for checkpoints); may be empty.
/// Throws std::invalid_argument on a bad config or mismatched shapes, TrainingCancelled.
void train_mlps(const PoseRows& inputs, const PoseRows& targets, const MlpConfig& config,
                const TrainingHooks& hooks, const std::function<void()>& node_done,
                std::vector<TrainedMlp>& networks);

}  // namespace nbd
