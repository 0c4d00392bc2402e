#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "collision/bounds/certified/build_certified_model.hpp"
#include "collision/topology/sphere_tree.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/tree_file.hpp"
#include "training/learn/cluster_modes.hpp"
#include "training/learn/labels.hpp"
#include "training/learn/train_learned.hpp"
#include "training/networks/mlp_trainer.hpp"

namespace nbd {

/// The kinds that training makes; `bd` and `learned_boxes` come along with them.
inline constexpr BoundKind trained_kinds[] = {BoundKind::nbd, BoundKind::learned_spheres};

/// All that decides what is trained. The defaults are the paper's, but for the label frame, which here
/// leaves alignment errors out, and the linear part of the centres.
struct TrainConfig {
    std::vector<BoundKind> bounds{BoundKind::nbd, BoundKind::learned_spheres};  // `modal` brings `bd` along
    SphereTreeConfig tree{};                                                    // depth 7
    int modes = 128;  // the lowest ones; a body with fewer brings what it has
    ClusterModesConfig clusters{};
    LabelFrame label_frame = LabelFrame::clustered;
    bool linear_centre = true;  // NbdModel::centre_map; without it labels are scaled element-wise
    /// Of the trajectories, in [0, 1): never seen in training. Without it as the recording says; see
    /// make_split.
    std::optional<double> held_out_share{};
    double calibration_share = 0.25;  // of the others, in [0, 1): kept for calibration
    double random_frame_share = 0.1;  // of the other trajectories' frames, in [0, 1): likewise
    MlpConfig mlp{};
    LearnedConfig learned{};
    CertifiedConfig certified{};  // of bodies that bring their tetrahedra
    std::uint64_t seed = 1;       // of the split, the clustering and the networks; overrides theirs
};

/// JSON text of the options: what TrainingFacts keep.
std::string to_json(const TrainConfig& config);

/// What a training needs beside its data and options, none of which changes its result.
struct TrainRun {
    TrainingHooks hooks{};
    /// Called at the start of each stage with its name. `hooks.progress` covers the networks of `modal`.
    std::function<void(std::string_view)> stage{};
    /// Where finished networks are kept; empty: nowhere. The caller removes it once the tree is saved.
    std::filesystem::path checkpoint{};
    double checkpoint_seconds = 10;  // at least so long between two checkpoints
    /// Stands in for train_mlps(), to the same result: for training dealt out to several processes. Empty:
    /// this process trains alone.
    std::function<void(const PoseRows& inputs, const PoseRows& targets, const MlpConfig& config,
                       const TrainingHooks& hooks, std::vector<TrainedMlp>& networks)>
        networks{};

    void enter(std::string_view name) const {
        if (stage) stage(name);
    }
};

/// Builds and trains the whole tree of a body from a recording: sphere tree, and the bounds that the config
/// names: clustered modes, BD-Tree and the networks of the paper, local bounds; not calibrated
/// yet, see calibrate(). Reads the recording once if `source`
/// has room for the frames of training and calibration; beside what it keeps, some numbers a pose and node
/// are in memory. The same arguments give the same bits, whatever the threads, the room and however often it
/// was interrupted, on one machine type. Throws std::invalid_argument on a config out of range or, with
/// `modal`, a body without modes, std::runtime_error on a recording of another body or with fewer training
/// poses than one batch, TrainingCancelled.
TreeFile train_tree(SurfaceBody body, FrameSource& source, TrainConfig config, const TrainRun& run = {});

/// Likewise, with a FrameSource of its own.
TreeFile train_tree(SurfaceBody body, const RecordingReader& recording, TrainConfig config,
                    const TrainRun& run = {});

}  // namespace nbd
