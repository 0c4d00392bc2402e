#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "apps/cli/interrupt.hpp"
#include "apps/cli/load_body.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/commands/calibration_options.hpp"
#include "apps/commands/commands.hpp"
#include "apps/commands/memory_option.hpp"
#include "apps/sharing/rank.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/surface/counted.hpp"
#include "sim/fem/modes.hpp"
#include "training/calibrate/calibrate.hpp"
#include "training/files/recording.hpp"
#include "training/learn/train_tree.hpp"

namespace nbd {
namespace {

struct TrainArguments {
    std::string body, recording, output, network = "default";
    std::vector<std::string> bounds{"nbd", "learned_affine"};
    std::optional<int> depth;                // default: default_depth()
    std::optional<int> modes;                // default: as many as TrainConfig has, or all of the body
    std::optional<std::string> label_frame;  // this and the next two: instead of the network's
    std::optional<bool> linear_centre;
    std::optional<double> weight_decay;
    TrainConfig config;
    CalibrateConfig calibrate;
    std::optional<std::size_t> memory;  // MiB
};

TrainConfig train_config(const TrainArguments& arguments) {
    TrainConfig config = arguments.config;
    if (arguments.modes) config.modes = *arguments.modes;
    if (arguments.network == "paper") use_paper_networks(config);
    if (arguments.label_frame) config.label_frame = label_frame(*arguments.label_frame);
    if (arguments.linear_centre) config.linear_centre = *arguments.linear_centre;
    if (arguments.weight_decay) config.mlp.weight_decay = *arguments.weight_decay;
    config.bounds.clear();
    for (const std::string& bound : arguments.bounds) config.bounds.push_back(bound_kind(bound));
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

void run(const TrainArguments& arguments, Output& out) {
    if (const Rank rank = this_rank(); rank.count > 1) {
        if (rank.number > 0) return;  // only rank 0 prints
        throw std::runtime_error(fmt::format(
            "train: was started as {} processes; allowed: one, without mpirun or srun, which uses all cores",
            rank.count));
    }
    check_output(arguments.output, {arguments.body, arguments.recording}, ".h5");
    TrainConfig config = train_config(arguments);
    const bool nbd = std::ranges::find(config.bounds, BoundKind::nbd) != config.bounds.end();

    TrainRun settings;
    settings.checkpoint = arguments.output + ".checkpoint";
    const std::filesystem::path& kept = settings.checkpoint;
    const auto enter = [&](std::string_view stage) {
        out.text(stage);
        out.work(stage);
        finish_on_interrupt(stage == networks_stage);
        if (std::filesystem::exists(kept))
            say_on_interrupt("the same command continues from " + kept.string());
        if (interrupted()) throw TrainingCancelled("training was stopped");
    };
    settings.stage = enter;
    settings.hooks.cancel = &interrupt_flag();
    settings.hooks.progress = [&](const TrainingProgress& done) {
        out.progress("networks", done.nodes_done, done.nodes,
                     fmt::format("mean loss {:.2e}", done.mean_loss));
    };

    const Body body = load_body(arguments.body);
    if (nbd && body.modes.count() == 0)
        throw std::runtime_error(
            fmt::format("{0}: has no modes, which nbd bounds need; compute them with: nbdtree modes {0}",
                        arguments.body));
    const Stopwatch watch;
    const RecordingReader recording(arguments.recording);
    const int modes = std::min(config.modes, body.modes.count());
    const std::string fewer = nbd ? fewer_modes(arguments.body, body, config.modes) : "";
    // Who asked for so many hears of it before the work; else it stands among the results.
    if (arguments.modes && !fewer.empty()) out.warning(fewer);
    SurfaceBody surface = surface_body(body);
    config.tree.depth = arguments.depth.value_or(default_depth(config.bounds, surface.F.rows()));
    FrameSource source(surface.W, recording, frame_memory(arguments.memory));
    TreeFile file;
    try {
        file = train_tree(std::move(surface), source, config, settings);
        enter(file.facts.split.calibration_trajectories.empty() ? "writing" : "calibrating");
    } catch (const TrainingCancelled&) {
        throw Interrupted(std::filesystem::exists(kept)
                              ? "the same command continues from " + kept.string()
                              : "nothing was written; the same command starts anew");
    }
    if (file.facts.split.calibration_trajectories.empty()) {
        out.warning("no trajectories were kept for calibration, so the bounds have no stated miss rate");
    } else {
        calibrate(file, source, arguments.calibrate);
    }
    save_tree(arguments.output, file);
    std::filesystem::remove(settings.checkpoint);
    const double seconds = watch.seconds();

    const TrainingFacts& facts = file.facts;
    const auto nodes = file.tree.spheres.nodes.size();
    out.text(fmt::format("{}: {} trained on {} of {} in {:.1f} s; {} to calibrate on, {} held out",
                         arguments.output, counted(nodes, "node"), counted(facts.poses, "pose"),
                         counted_trajectories(facts.split.train_trajectories.size()), seconds,
                         facts.split.calibration_trajectories.size(),
                         facts.split.held_out_trajectories.size()));
    if (const int left_out = troubled_frames(recording); left_out > 0 && !facts.split.troubled_frames)
        out.text(fmt::format("left out: {} of steps that went wrong", counted(left_out, "frame")));
    for (const auto& [kind, calibration] : file.tree.calibrations)
        out.text(describe(kind, calibration, {file.tree, kind}));
    nlohmann::ordered_json result = {{"nodes", nodes},
                                     {"poses", facts.poses},
                                     {"train_trajectories", facts.split.train_trajectories},
                                     {"calibration_trajectories", facts.split.calibration_trajectories},
                                     {"held_out_trajectories", facts.split.held_out_trajectories},
                                     {"seconds", seconds}};
    const double reads =
        static_cast<double>(recording.frames_read()) / static_cast<double>(recording.frames());
    result["recording_reads"] = reads;
    result["kept_position_bytes"] = source.kept_bytes();
    if (nbd) {
        out.text(fmt::format("error of the clustered coordinates {:.2f} %, mean loss {:.2e}",
                             100 * facts.z_error, facts.node_loss.mean()));
        if (!arguments.modes && !fewer.empty()) out.text(fewer);
        result["modes"] = modes;
        result["z_error"] = facts.z_error;
        result["mean_loss"] = facts.node_loss.mean();
    }
    out.text(fmt::format("read the recording {:.3g} {} (kept {:.3g} MB of positions in memory)", reads,
                         reads == 1 ? "time" : "times", static_cast<double>(source.kept_bytes()) / 1e6));
    out.result(result);
}

}  // namespace

void add_train(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<TrainArguments>();
    TrainConfig& config = arguments->config;
    CLI::App* command = app.add_subcommand("train", "Trains the bounds of a body's tree on a recording");
    command->add_option("BODY", arguments->body, "Body file with modes")->required();
    command->add_option("DATA", arguments->recording, "Recording of the body")->required();
    command->add_option("-o,--output", arguments->output, "Tree file to write")->required();
    command
        ->add_option("--bounds", arguments->bounds, "Bounds to train, separated by commas; nbd includes bd")
        ->delimiter(',')
        ->capture_default_str()
        ->check(bounds_name(trained_kinds));
    command
        ->add_option(
            "--depth", arguments->depth,
            "Levels of the tree below the root; default: with nbd 7, as in the paper, else at least 7, "
            "with leaves of at most 600 faces")
        ->check(whole_number(0, 16));
    command
        ->add_option("-m,--modes", arguments->modes,
                     fmt::format("Number of modal coordinates; default: {}, or all of a body that has fewer",
                                 config.modes))
        ->check(whole_number(1, 2048));
    command
        ->add_option("-k,--clusters", config.clusters.k_means.clusters, "Number of representative vertices")
        ->capture_default_str()
        ->check(whole_number(4, 100'000));
    command
        ->add_option("--initialisations", config.clusters.initialisations,
                     "Runs of k-means; the best one is kept")
        ->capture_default_str()
        ->check(whole_number(1, 1000));
    command
        ->add_option("--network", arguments->network,
                     "Networks of nbd bounds: default, or paper, which are as the paper has them: full label "
                     "frame, no linear part, no weight decay, float32")
        ->capture_default_str()
        ->check(one_of({"default", "paper"}));
    command
        ->add_option("--label-frame", arguments->label_frame,
                     "Alignment of the labels: clustered, as for the modal coordinates, or full, over all "
                     "vertices; default: clustered, paper networks: full")
        ->check(one_of({"clustered", "full"}));
    command
        ->add_option("--linear-centre", arguments->linear_centre,
                     "Whether to fit a linear part of the centres besides the networks; default: true, paper "
                     "networks: false")
        ->check(one_of({"true", "false", "1", "0"}));
    command
        ->add_option("--weight-decay", arguments->weight_decay,
                     "Share of the learning rate by which weights shrink per step; default: 0.1, paper "
                     "networks: 0")
        ->check(between(0, 1));
    CLI::Option* held_out =
        command
            ->add_option("--held-out", config.held_out_share,
                         "Share of the trajectories that training never sees; default: as in the dataset")
            ->check(number_check(">= 0 and < 1", [](double value) { return value >= 0 && value < 1; }));
    command
        ->add_option("--split", config.split,
                     "Split of the dataset: trajectories, or parameter, which `dataset --hold-out` makes")
        ->excludes(held_out);
    command
        ->add_option("--calibration", config.calibration_share,
                     "Share of the other trajectories to calibrate margins on; 0: no stated miss rate")
        ->capture_default_str()
        ->check(number_check(">= 0 and < 1", [](double value) { return value >= 0 && value < 1; }));
    add_calibration_options(*command, arguments->calibrate);
    command
        ->add_option("--random-frames", config.random_frame_share,
                     "Share of the training trajectories' frames to keep for evaluation")
        ->capture_default_str()
        ->check(number_check(">= 0 and < 1", [](double value) { return value >= 0 && value < 1; }));
    command->add_flag("--troubled-frames", config.troubled_frames,
                      "Also use frames of steps that went wrong, which are left out otherwise");
    command
        ->add_option("--epochs", config.mlp.max_epochs,
                     "Maximum epochs; training ends earlier when it has converged")
        ->capture_default_str()
        ->check(whole_number(1, 1'000'000));
    add_memory_option(*command, arguments->memory);
    command->add_option("--seed", config.seed, "Seed of the split, the clustering and the networks")
        ->capture_default_str()
        ->check(seed_check());
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
