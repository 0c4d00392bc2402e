#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "collision/tree/collision_tree.hpp"
#include "training/files/surface_body.hpp"

namespace nbd {

/// Which frames a tree was trained on, so that calibration and evaluation can use the others.
/// Splits are by trajectory: those to train on, those that margins are calibrated on, and those that nothing
/// but evaluation sees. Within the training trajectories some frames drawn at random are kept out as well,
/// because papers test on those.
struct TrainingSplit {
    std::vector<int> train_trajectories;  // ids
    std::vector<int> calibration_trajectories{};
    std::vector<int> held_out_trajectories{};
    std::uint64_t frame_seed = 0;  // is_random_test_frame() draws from it
    float random_frame_share = 0;  // of the training trajectories' frames, kept out of training
};

/// Whether a frame of a training trajectory was kept out of training. Counter-based: depends on its
/// arguments alone.
bool is_random_test_frame(const TrainingSplit& split, int trajectory, int frame) noexcept;

struct TrainingFacts {
    std::string body_hash;
    std::string recording_hash;  // of the recording's positions as stored: names the data, not the file
    std::string config;          // JSON text of the options
    TrainingSplit split;
    int poses = 0;
    Eigen::VectorXf node_loss;  // [nodes] final training loss (mean squared error of scaled outputs)
    double z_error = 0;         // mean |z - zhat| / |z| over the training poses
};

struct TreeFile {
    CollisionTree tree;
    Vertices X;          // [n, 3] rest positions of the surface, metres
    SurfaceEmbedding W;  // [n, N] carries recorded tet nodes to the surface
    TetMesh solid{};     // its tetrahedra; empty unless the tree has `certified` bounds
    TrainingFacts facts;
};

/// The surface that the tree was trained on, without its modes: what it takes to pose the tree from a
/// recording.
SurfaceBody surface_body(const TreeFile& file);

/// Writes atomically. Throws std::runtime_error with path and reason.
void save_tree(const std::filesystem::path& path, const TreeFile& file);

/// Throws std::runtime_error on a missing, truncated, damaged or foreign file, or inconsistent content.
TreeFile load_tree(const std::filesystem::path& path);

}  // namespace nbd
