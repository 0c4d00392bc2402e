#include "apps/train/tree_training.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "apps/cli/interrupt.hpp"
#include "apps/cli/load_body.hpp"
#include "apps/cli/output_paths.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/surface/counted.hpp"
#include "sim/fem/modes.hpp"
#include "training/calibrate/conformal.hpp"

namespace nbd {
namespace {

TrainConfig config_of(const TrainOptions& options) {
    TrainConfig config = options.config;
    if (options.modes) config.modes = *options.modes;
    if (options.paper_networks) use_paper_networks(config);
    if (options.label_frame) config.label_frame = *options.label_frame;
    if (options.linear_centre) config.linear_centre = *options.linear_centre;
    if (options.weight_decay) config.mlp.weight_decay = *options.weight_decay;
    return config;
}

/// Says that a body has fewer modes than training would take; empty if it has as many.
std::string fewer_modes(const std::string& path, const Body& body, int wanted) {
    const int has = body.modes.count(), possible = most_modes(body.tets.X.rows());
    if (has >= wanted) return {};
    if (has >= possible)
        return fmt::format("{}: has {} modes, as many as it can have, all of which are used", path, has);
    return fmt::format("{0}: has {1} modes, all of which are used; `nbdtree modes {0} -m {2}` computes {2}",
                       path, has, std::min(wanted, possible));
}

}  // namespace

TreeTraining::TreeTraining(TrainOptions options, Output& out)
    : options_(std::move(options)),
      out_(out),
      config_(config_of(options_)),
      checkpoint_(options_.output + ".checkpoint") {
    check_output(options_.output, {options_.body, options_.recording}, ".h5");
}

bool TreeTraining::has_nbd() const {
    return std::ranges::find(config_.bounds, BoundKind::nbd) != config_.bounds.end();
}

void TreeTraining::enter(std::string_view stage) const {
    out_.text(stage);
    out_.work(stage);
    finish_on_interrupt(stage == networks_stage);
    if (std::filesystem::exists(checkpoint_))
        say_on_interrupt("the same command continues from " + checkpoint_.string());
    if (interrupted()) throw TrainingCancelled("training was stopped");
}

void TreeTraining::run() {
    const Body body = load_body(options_.body);
    if (has_nbd()) {
        if (body.modes.count() == 0)
            throw std::runtime_error(
                fmt::format("{0}: has no modes, which nbd bounds need; compute them with: nbdtree modes {0}",
                            options_.body));
        fewer_modes_ = fewer_modes(options_.body, body, config_.modes);
    }
    const Stopwatch watch;
    const RecordingReader recording(options_.recording);
    // Who asked for so many hears of it before the work; else it stands among the results.
    if (options_.modes && !fewer_modes_.empty()) out_.warning(fewer_modes_);
    SurfaceBody surface = surface_body(body);
    config_.tree.depth = options_.depth.value_or(default_depth(config_.bounds, surface.F.rows()));
    FrameSource source(surface.W, recording, options_.memory);
    TreeFile file = train(std::move(surface), source);
    if (file.facts.split.calibration_trajectories.empty())
        out_.warning("no trajectories were kept for calibration, so the bounds have no stated miss rate");
    else
        calibrate(file, source, options_.calibrate);
    save_tree(options_.output, file);
    std::filesystem::remove(checkpoint_);
    tell(file, recording, source, std::min(config_.modes, body.modes.count()), watch.seconds());
}

TreeFile TreeTraining::train(SurfaceBody surface, FrameSource& source) const {
    TrainRun run;
    run.checkpoint = checkpoint_;
    run.stage = [this](std::string_view stage) { enter(stage); };
    run.hooks.cancel = interrupted;
    run.hooks.progress = [this](const TrainingProgress& done) {
        out_.progress("networks", done.nodes_done, done.nodes,
                      fmt::format("mean loss {:.2e}", done.mean_loss));
    };
    try {
        TreeFile file = train_tree(std::move(surface), source, config_, run);
        enter(file.facts.split.calibration_trajectories.empty() ? "writing" : "calibrating");
        return file;
    } catch (const TrainingCancelled&) {
        throw Interrupted(std::filesystem::exists(checkpoint_)
                              ? "the same command continues from " + checkpoint_.string()
                              : "nothing was written; the same command starts anew");
    }
}

/// modes: that nbd bounds use.
void TreeTraining::tell(const TreeFile& file, const RecordingReader& recording, const FrameSource& source,
                        int modes, double seconds) const {
    const TrainingFacts& facts = file.facts;
    const auto nodes = file.tree.spheres.nodes.size();
    out_.text(fmt::format("{}: {} trained on {} of {} in {:.1f} s; {} to calibrate on, {} held out",
                          options_.output, counted(nodes, "node"), counted(facts.poses, "pose"),
                          counted_trajectories(facts.split.train_trajectories.size()), seconds,
                          facts.split.calibration_trajectories.size(),
                          facts.split.held_out_trajectories.size()));
    if (const int left_out = troubled_frames(recording); left_out > 0 && !facts.split.troubled_frames)
        out_.text(fmt::format("left out: {} of steps that went wrong", counted(left_out, "frame")));
    for (const auto& [kind, calibration] : file.tree.calibrations)
        out_.text(describe(kind, calibration, {file.tree, kind}));
    const double reads = double(recording.frames_read()) / double(recording.frames());
    nlohmann::ordered_json result = {{"nodes", nodes},
                                     {"poses", facts.poses},
                                     {"train_trajectories", facts.split.train_trajectories},
                                     {"calibration_trajectories", facts.split.calibration_trajectories},
                                     {"held_out_trajectories", facts.split.held_out_trajectories},
                                     {"seconds", seconds},
                                     {"recording_reads", reads},
                                     {"kept_position_bytes", source.kept_bytes()}};
    if (has_nbd()) {
        out_.text(fmt::format("error of the clustered coordinates {:.2f} %, mean loss {:.2e}",
                              100 * facts.z_error, facts.node_loss.mean()));
        if (!options_.modes && !fewer_modes_.empty()) out_.text(fewer_modes_);
        result["modes"] = modes;
        result["z_error"] = facts.z_error;
        result["mean_loss"] = facts.node_loss.mean();
    }
    out_.text(fmt::format("read the recording {:.3g} {} (kept {:.3g} MB of positions in memory)", reads,
                          reads == 1 ? "time" : "times", 1e-6 * double(source.kept_bytes())));
    out_.result(result);
}

std::string describe(BoundKind kind, const Calibration& calibration, const BoundLevels& levels) {
    std::string text = fmt::format(
        "{} bounds: at most {:g} % of a depth's nodes miss, pose by pose, in {:.4g} % of trajectories, on "
        "average over calibration sets and for each depth by itself; from {} of {}: with 5 % chance, this set "
        "gives less than {:.3g} %; mean margins by depth{}",
        name(kind), 100 * calibration.miss_rate, 100 * calibration.confidence,
        counted(calibration.poses, "pose"), counted_trajectories(calibration.trajectories),
        100 * share_kept_but_for(0.05, calibration.trajectories, calibration.confidence),
        calibration.limits.empty() ? "" : ", for inputs at the edge of the calibrated range");
    for (int depth = 0; depth < levels.count(); ++depth) {
        const auto begin = calibration.margins.begin() + levels.begins[depth],
                   end = calibration.margins.begin() + levels.begins[depth + 1];
        text += fmt::format(" {:.2f}", 100 * std::accumulate(begin, end, 0.) / double(end - begin));
    }
    return text +
           (kind == BoundKind::learned_affine ? " % of a spread, then of residuals" : " % of the radius");
}

}  // namespace nbd
