#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <utility>

#include "apps/cli/interrupt.hpp"
#include "apps/cli/load_body.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/cli/rank.hpp"
#include "apps/commands/commands.hpp"
#include "apps/commands/training_options.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/body/body.hpp"
#include "meshing/surface/counted.hpp"
#include "sim/fem/modes.hpp"
#include "training/files/recording.hpp"
#include "training/learn/train_tree.hpp"

namespace nbd {
namespace {

struct TrainArguments {
    std::string body, recording, output;  // files
    std::vector<std::string> bounds{"nbd", "learned_affine"};
    std::string network = "default";
    TrainConfig config{};             // where nothing else says otherwise
    std::optional<int> depth, modes;  // of the tree; default: default_depth(), and as many as the body has
    CalibrateConfig calibrate{};
    std::optional<std::size_t> memory;  // MiB
};

TrainConfig config_of(const TrainArguments& arguments) {
    TrainConfig config = arguments.config;
    config.bounds.clear();
    for (const std::string& bound : arguments.bounds) config.bounds.push_back(bound_kind(bound));
    if (arguments.modes) config.modes = *arguments.modes;
    if (arguments.network == "paper") use_paper_networks(config);
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

/// Trains and calibrates the bounds of a body's tree. The networks that are done are kept in a file beside
/// the output, from which a training that was stopped or killed continues.
class TreeTraining {
 public:
    /// Checks the output.
    TreeTraining(const TrainArguments& arguments, Output& out)
        : arguments_(arguments),
          out_(out),
          config_(config_of(arguments)),
          checkpoint_(arguments.output + ".checkpoint") {
        check_output(arguments.output, {arguments.body, arguments.recording}, ".h5");
    }

    /// Writes the tree and tells what was done. Throws what reading and training throw, one line, and
    /// Interrupted where the user stops it.
    void run();

 private:
    bool has_nbd() const { return std::ranges::count(config_.bounds, BoundKind::nbd) > 0; }
    void enter(std::string_view stage) const;
    TreeFile train(SurfaceBody surface, FrameSource& source) const;
    void tell(const TreeFile& file, const RecordingReader& recording, const FrameSource& source, int modes,
              double seconds) const;

    const TrainArguments& arguments_;
    Output& out_;
    TrainConfig config_;
    std::filesystem::path checkpoint_;
    std::string fewer_modes_;  // than training would take, one line; empty: as many
};

void TreeTraining::enter(std::string_view stage) const {
    out_.text(stage);
    out_.work(stage);
    finish_on_interrupt(stage == networks_stage);
    if (std::filesystem::exists(checkpoint_))
        say_on_interrupt("the same command continues from " + checkpoint_.string());
    if (interrupted()) throw TrainingCancelled("training was stopped");
}

void TreeTraining::run() {
    const Body body = load_body(arguments_.body);
    if (has_nbd()) {
        if (body.modes.count() == 0)
            throw std::runtime_error(
                fmt::format("{0}: has no modes, which nbd bounds need; compute them with: nbdtree modes {0}",
                            arguments_.body));
        fewer_modes_ = fewer_modes(arguments_.body, body, config_.modes);
    }
    const Stopwatch watch;
    const RecordingReader recording(arguments_.recording);
    // Who asked for so many hears of it before the work; else it stands among the results.
    if (arguments_.modes && !fewer_modes_.empty()) out_.warning(fewer_modes_);
    SurfaceBody surface = surface_body(body);
    config_.tree.depth = arguments_.depth.value_or(default_depth(config_.bounds, surface.F.rows()));
    FrameSource source(surface.W, recording, frame_memory(arguments_.memory));
    TreeFile file = train(std::move(surface), source);
    if (file.facts.split.calibration_trajectories.empty())
        out_.warning("no trajectories were kept for calibration, so the bounds have no stated miss rate");
    else
        calibrate(file, source, arguments_.calibrate);
    save_tree(arguments_.output, file);
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
                          arguments_.output, counted(nodes, "node"), counted(facts.poses, "pose"),
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
        if (!arguments_.modes && !fewer_modes_.empty()) out_.text(fewer_modes_);
        result["modes"] = modes;
        result["z_error"] = facts.z_error;
        result["mean_loss"] = facts.node_loss.mean();
    }
    out_.text(fmt::format("read the recording {:.3g} {} (kept {:.3g} MB of positions in memory)", reads,
                          reads == 1 ? "time" : "times", 1e-6 * double(source.kept_bytes())));
    out_.result(result);
}

void run(const TrainArguments& arguments, Output& out) {
    if (const Rank rank = this_rank(); rank.count > 1) {
        if (rank.number > 0) return;  // only rank 0 prints
        throw std::runtime_error(fmt::format(
            "train: was started as {} processes; allowed: one, without mpirun or srun, which uses all cores",
            rank.count));
    }
    TreeTraining(arguments, out).run();
}

CLI::Validator below_one() {
    return number_check(">= 0 and < 1", [](double value) { return value >= 0 && value < 1; });
}

/// Options of `nbd` bounds.
void add_network_options(CLI::App& command, TrainArguments& arguments) {
    TrainConfig& config = arguments.config;
    command
        .add_option("-m,--modes", arguments.modes,
                    fmt::format("Number of modal coordinates; default: {}, or all of a body that has fewer",
                                config.modes))
        ->check(whole_number(1, 2048));
    command
        .add_option("-k,--clusters", config.clusters.k_means.clusters, "Number of representative vertices")
        ->check(whole_number(4, 100'000));
    command
        .add_option("--initialisations", config.clusters.initialisations,
                    "Runs of k-means; the best one is kept")
        ->check(whole_number(1, 1000));
    command
        .add_option("--network", arguments.network,
                    "Networks of nbd bounds: default, or paper, which are as the paper has them: full label "
                    "frame, no linear part, no weight decay, float32")
        ->check(one_of({"default", "paper"}));
    command
        .add_option("--epochs", config.mlp.max_epochs,
                    "Maximum epochs; training ends earlier when it has converged")
        ->check(whole_number(1, 1'000'000));
}

/// Which frames train, calibrate, and are kept for evaluation.
void add_frame_options(CLI::App& command, TrainConfig& config) {
    CLI::Option* held_out =
        command
            .add_option("--held-out", config.held_out_share,
                        "Share of the trajectories that training never sees; default: as in the dataset")
            ->check(below_one());
    command
        .add_option("--split", config.split,
                    "Split of the dataset: trajectories, or parameter, which `dataset --hold-out` makes")
        ->excludes(held_out);
    command
        .add_option("--calibration", config.calibration_share,
                    "Share of the other trajectories to calibrate margins on; 0: no stated miss rate")
        ->check(below_one());
    command.add_flag("--troubled-frames", config.troubled_frames,
                     "Also use frames of steps that went wrong, which are left out otherwise");
}

}  // namespace

void add_train(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<TrainArguments>(
        app, out, "train", "Trains the bounds of a body's tree on a recording", run);
    command.add_option("BODY", arguments.body, "Body file with modes")->required();
    command.add_option("DATA", arguments.recording, "Recording of the body")->required();
    command.add_option("-o,--output", arguments.output, "Tree file to write")->required();
    command.add_option("--bounds", arguments.bounds, "Bounds to train, separated by commas; nbd includes bd")
        ->delimiter(',')
        ->check(bounds_name(trained_kinds));
    command
        .add_option(
            "--depth", arguments.depth,
            "Levels of the tree below the root; default: with nbd 7, as in the paper, else at least 7, "
            "with leaves of at most 600 faces")
        ->check(whole_number(0, 16));
    add_network_options(command, arguments);
    add_frame_options(command, arguments.config);
    add_calibration_options(command, arguments.calibrate);
    add_memory_option(command, arguments.memory);
    command.add_option("--seed", arguments.config.seed, "Seed of the split, the clustering and the networks")
        ->check(seed_check());
}

}  // namespace nbd
