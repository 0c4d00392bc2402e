#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "training/files/recording_hash.hpp"
#include "training/files/surface_body.hpp"

namespace nbd {

/// Records which frames a tree was trained on, so that calibration and evaluation can use the others. Whole
/// trajectories are used either for training, for calibrating margins, or for evaluation alone. Random frames
/// of the training trajectories are kept out too, because papers test on such frames.
struct TrainingSplit {
    std::vector<int> train_trajectories;  // ids
    std::vector<int> calibration_trajectories{};
    std::vector<int> held_out_trajectories{};
    std::uint64_t frame_seed = 0;  // seed of is_random_test_frame()
    float random_frame_share = 0;  // share of the training trajectories' frames kept out of training
    bool troubled_frames = false;  // whether frames of steps that went wrong belong to the parts
};

/// True if a frame of a training trajectory is kept out of training. Counter-based, so it depends on the
/// arguments alone.
bool is_random_test_frame(const TrainingSplit& split, int trajectory, int frame) noexcept;

struct TrainingFacts {
    std::string body_hash;
    std::string recording_hash;  // RecordingHash::hex of the training data, not of the file
    std::string config;          // JSON text of the options
    TrainingSplit split;
    /// Trajectories that the tree was trained and last calibrated on; absent in trees of older files.
    std::optional<SeenTrajectories> trained_on{}, calibrated_on{};
    int poses = 0;
    Eigen::VectorXf node_loss;  // [nodes] final training loss (mean squared error of scaled outputs)
    double z_error = 0;         // mean |z - zhat| / |z| over the training poses
};

struct TreeFile {
    CollisionTree tree;
    Vertices X;          // [n, 3] rest positions of the surface, metres
    SurfaceEmbedding W;  // [n, N] maps recorded tet nodes to the surface
    TrainingFacts facts;
};

/// The body that the tree was trained on, without its modes and tetrahedra; enough to pose the tree from a
/// recording.
SurfaceBody surface_body(const TreeFile& file);

/// Writes atomically. Throws std::runtime_error with path and reason.
void save_tree(const std::filesystem::path& path, const TreeFile& file);

/// Throws std::runtime_error on a missing, truncated, damaged or foreign file, or inconsistent content.
TreeFile load_tree(const std::filesystem::path& path);

}  // namespace nbd
