#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "apps/cli/output.hpp"
#include "meshing/body/body.hpp"
#include "training/calibrate/calibrate.hpp"
#include "training/files/recording.hpp"
#include "training/learn/train_tree.hpp"

namespace nbd {

/// What a training is asked for.
struct TrainOptions {
    std::string body, recording, output;  // files
    TrainConfig config{};                 // where nothing below says otherwise
    std::optional<int> depth{};           // of the tree; default: default_depth()
    std::optional<int> modes{};           // default: as many as TrainConfig has, or all of the body
    bool paper_networks = false;          // see use_paper_networks(), which the next three override
    std::optional<LabelFrame> label_frame{};
    std::optional<bool> linear_centre{};
    std::optional<double> weight_decay{};
    CalibrateConfig calibrate{};
    std::size_t memory = 0;  // bytes of positions that may be kept
};

/// Trains and calibrates the bounds of a body's tree. The networks that are done are kept in a file beside
/// the output, from which a training that was stopped or killed continues.
class TreeTraining {
 public:
    /// Checks the output.
    TreeTraining(TrainOptions options, Output& out);

    /// Writes the tree and tells what was done. Throws what reading and training throw, one line, and
    /// Interrupted where the user stops it.
    void run();

 private:
    bool has_nbd() const;
    void enter(std::string_view stage) const;
    TreeFile train(SurfaceBody surface, FrameSource& source) const;
    void tell(const TreeFile& file, const RecordingReader& recording, const FrameSource& source, int modes,
              double seconds) const;

    TrainOptions options_;
    Output& out_;
    TrainConfig config_;
    std::filesystem::path checkpoint_;
    std::string fewer_modes_;  // than training would take, one line; empty: as many
};

/// One line: stated miss rate and confidence, size of the calibration set, mean margins.
std::string describe(BoundKind kind, const Calibration& calibration, const BoundLevels& levels);

}  // namespace nbd
