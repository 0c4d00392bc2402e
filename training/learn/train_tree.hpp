#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "collision/nbd_tree/sphere_tree.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/tree_file.hpp"
#include "training/learn/cluster_modes.hpp"
#include "training/learn/labels.hpp"
#include "training/learn/train_learned_affine.hpp"
#include "training/networks/mlp_trainer.hpp"

namespace nbd {

/// The bounds that training produces; `bd` comes with `nbd`.
inline constexpr BoundKind trained_kinds[] = {BoundKind::nbd, BoundKind::learned_affine};

/// Options of a training. The defaults are the paper's, except for those of `nbd` bounds that
/// use_paper_networks() sets.
struct TrainConfig {
    std::vector<BoundKind> bounds{BoundKind::nbd, BoundKind::learned_affine};  // `nbd` includes `bd`
    SphereTreeConfig tree{};                                                   // depth 7
    int modes = 128;  // the lowest ones; all of a body that has fewer
    ClusterModesConfig clusters{};
    LabelFrame label_frame = LabelFrame::clustered;
    bool linear_centre = true;  // fit NbdModel::centre_map; if false, labels are scaled element-wise
    /// Share of the trajectories that training never sees, in [0, 1); if empty, see make_split().
    std::optional<double> held_out_share{};
    std::string split{};              // of the dataset, by its name, instead of a share; may be empty
    double calibration_share = 0.25;  // of the other trajectories, in [0, 1): kept for calibration
    double random_frame_share = 0.1;  // of the training trajectories' frames, in [0, 1): kept for evaluation
    bool troubled_frames = false;     // whether to use frames of steps that went wrong
    MlpConfig mlp{};
    NetworkNumbers network_numbers = NetworkNumbers::bytes;
    LearnedAffineConfig learned_affine{};
    std::uint64_t seed = 1;  // of the split, clustering and networks; overrides their seeds
};

/// Sets every option of `nbd` bounds in which the defaults deviate from the paper: labels in the frame of the
/// full alignment, no linear part of the centres (so that outputs are scaled one by one), no weight decay,
/// float32 in training and in the trained networks.
void use_paper_networks(TrainConfig& config);

/// Depth of a tree for these bounds on a surface of so many faces: with `nbd` 7, as in the paper; else at
/// least 7 and at most 16, so that leaves have at most 600 faces, since queries of larger ones read too much.
int default_depth(std::span<const BoundKind> bounds, Eigen::Index faces);

/// JSON text of the options, for TrainingFacts::config.
std::string to_json(const TrainConfig& config);

/// The stage whose work a checkpoint keeps.
inline constexpr std::string_view networks_stage = "training networks";

/// Callbacks and checkpoint settings of a training; they do not change its result.
struct TrainRun {
    TrainingHooks hooks{};
    /// Called at the start of each stage with its name. `hooks.progress` covers the networks of `nbd`.
    std::function<void(std::string_view)> stage{};
    /// File for finished networks; empty: none. The caller removes it once the tree is saved.
    std::filesystem::path checkpoint{};
    double checkpoint_seconds = 10;  // minimum time between two checkpoints

    void enter(std::string_view name) const {
        if (stage) stage(name);
    }
};

/// Builds and trains a body's tree from a recording: the sphere tree and the bounds named by the config,
/// which are clustered modes, BD-Tree and the paper's networks (nbd), and learned affine boxes. Bodies with
/// tetrahedra also get affine bounds. Not calibrated yet, see calibrate(). Reads the recording once if
/// `source` has room for the frames of training and calibration, else in every pass; memory also holds a few
/// numbers per pose and node. Same bits for the same arguments on one machine type, whatever the number of
/// threads and interruptions. Throws std::invalid_argument on a config out of range or, with `nbd`, a body
/// without modes; std::runtime_error on a recording of another body or with fewer training poses than one
/// batch; TrainingCancelled.
TreeFile train_tree(SurfaceBody body, FrameSource& source, TrainConfig config, const TrainRun& run = {});

/// The same with a FrameSource of its own.
TreeFile train_tree(SurfaceBody body, const RecordingReader& recording, TrainConfig config,
                    const TrainRun& run = {});

}  // namespace nbd
