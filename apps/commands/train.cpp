#include <fmt/format.h>

#include <memory>
#include <optional>

#include "apps/cli/option_checks.hpp"
#include "apps/commands/commands.hpp"
#include "apps/commands/training_options.hpp"
#include "apps/sharing/rank.hpp"
#include "apps/train/tree_training.hpp"

namespace nbd {
namespace {

struct TrainArguments {
    std::vector<std::string> bounds{"nbd", "learned_affine"};
    std::string network = "default";
    std::optional<std::string> label_frame;
    std::optional<std::size_t> memory;  // MiB
    TrainOptions options;
};

void run(TrainArguments arguments, Output& out) {
    if (const Rank rank = this_rank(); rank.count > 1) {
        if (rank.number > 0) return;  // only rank 0 prints
        throw std::runtime_error(fmt::format(
            "train: was started as {} processes; allowed: one, without mpirun or srun, which uses all cores",
            rank.count));
    }
    TrainOptions& options = arguments.options;
    options.config.bounds.clear();
    for (const std::string& bound : arguments.bounds) options.config.bounds.push_back(bound_kind(bound));
    options.paper_networks = arguments.network == "paper";
    if (arguments.label_frame) options.label_frame = label_frame(*arguments.label_frame);
    options.memory = frame_memory(arguments.memory);
    TreeTraining(options, out).run();
}

CLI::Validator below_one() {
    return number_check(">= 0 and < 1", [](double value) { return value >= 0 && value < 1; });
}

/// Options of `nbd` bounds.
void add_network_options(CLI::App& command, TrainArguments& arguments) {
    TrainOptions& options = arguments.options;
    TrainConfig& config = options.config;
    command
        .add_option("-m,--modes", options.modes,
                    fmt::format("Number of modal coordinates; default: {}, or all of a body that has fewer",
                                config.modes))
        ->check(whole_number(1, 2048));
    command
        .add_option("-k,--clusters", config.clusters.k_means.clusters, "Number of representative vertices")
        ->capture_default_str()
        ->check(whole_number(4, 100'000));
    command
        .add_option("--initialisations", config.clusters.initialisations,
                    "Runs of k-means; the best one is kept")
        ->capture_default_str()
        ->check(whole_number(1, 1000));
    command
        .add_option("--network", arguments.network,
                    "Networks of nbd bounds: default, or paper, which are as the paper has them: full label "
                    "frame, no linear part, no weight decay, float32")
        ->capture_default_str()
        ->check(one_of({"default", "paper"}));
    command
        .add_option("--label-frame", arguments.label_frame,
                    "Alignment of the labels: clustered, as for the modal coordinates, or full, over all "
                    "vertices; default: clustered, paper networks: full")
        ->check(one_of({"clustered", "full"}));
    command
        .add_option("--linear-centre", options.linear_centre,
                    "Whether to fit a linear part of the centres besides the networks; default: true, paper "
                    "networks: false")
        ->check(one_of({"true", "false", "1", "0"}));
    command
        .add_option("--weight-decay", options.weight_decay,
                    "Share of the learning rate by which weights shrink per step; "
                    "default: 0.1, paper networks: 0")
        ->check(between(0, 1));
    command
        .add_option("--epochs", config.mlp.max_epochs,
                    "Maximum epochs; training ends earlier when it has converged")
        ->capture_default_str()
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
        ->capture_default_str()
        ->check(below_one());
    command
        .add_option("--random-frames", config.random_frame_share,
                    "Share of the training trajectories' frames to keep for evaluation")
        ->capture_default_str()
        ->check(below_one());
    command.add_flag("--troubled-frames", config.troubled_frames,
                     "Also use frames of steps that went wrong, which are left out otherwise");
}

}  // namespace

void add_train(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<TrainArguments>();
    TrainOptions& options = arguments->options;
    CLI::App* command = app.add_subcommand("train", "Trains the bounds of a body's tree on a recording");
    command->add_option("BODY", options.body, "Body file with modes")->required();
    command->add_option("DATA", options.recording, "Recording of the body")->required();
    command->add_option("-o,--output", options.output, "Tree file to write")->required();
    command
        ->add_option("--bounds", arguments->bounds, "Bounds to train, separated by commas; nbd includes bd")
        ->delimiter(',')
        ->capture_default_str()
        ->check(bounds_name(trained_kinds));
    command
        ->add_option(
            "--depth", options.depth,
            "Levels of the tree below the root; default: with nbd 7, as in the paper, else at least 7, "
            "with leaves of at most 600 faces")
        ->check(whole_number(0, 16));
    add_network_options(*command, *arguments);
    add_frame_options(*command, options.config);
    add_calibration_options(*command, options.calibrate);
    add_memory_option(*command, arguments->memory);
    command->add_option("--seed", options.config.seed, "Seed of the split, the clustering and the networks")
        ->capture_default_str()
        ->check(seed_check());
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
