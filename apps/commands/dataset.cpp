#include <fmt/core.h>
#include <tbb/global_control.h>

#include <atomic>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <utility>

#include "apps/cli/interrupt.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/cli/rank.hpp"
#include "apps/cli/test_points.hpp"
#include "apps/commands/commands.hpp"
#include "apps/dataset/card.hpp"
#include "apps/dataset/hold_out.hpp"
#include "apps/dataset/plan.hpp"
#include "apps/dataset/producer.hpp"
#include "apps/dataset/scene_trajectories.hpp"
#include "apps/dataset/value_table.hpp"
#include "apps/dataset/variety.hpp"
#include "collision/base/file_name.hpp"
#include "meshing/body/body.hpp"
#include "meshing/body/body_hints.hpp"
#include "meshing/surface/counted.hpp"
#include "sim/factor/blas.hpp"
#include "training/files/dataset_manifest.hpp"

namespace nbd {
namespace {

struct DatasetArguments {
    const CLI::App* command = nullptr;  // as parsed
    std::string source;                 // file of the body or scene
    std::string output, recipe, csv, shard, licence;
    std::optional<double> strength;
    std::optional<int> frames;
    std::string recorded, values;  // of a scene: name of the body whose poses are recorded; table
    DatasetPlan plan;
};

/// This process's part of the trajectories: those with index % count == number.
struct Shard {
    int number = 0, count = 1;
};

Shard parse_shard(const std::string& text) {
    Shard shard;
    if (text.empty()) return shard;
    int used = 0;
    if (std::sscanf(text.c_str(), "%d/%d%n", &shard.number, &shard.count, &used) != 2 ||
        used != std::ssize(text) || shard.count < 1 || shard.number < 0 || shard.number >= shard.count)
        throw CLI::ValidationError("--shard", fmt::format("'{}' is not i/N with 0 <= i < N", text));
    return shard;
}

RecipeRanges load_ranges(const DatasetArguments& arguments) {
    RecipeRanges ranges;
    if (!arguments.recipe.empty()) ranges = load_recipe_ranges(arguments.recipe);
    if (arguments.strength) ranges.strength = *arguments.strength;
    return ranges;
}

ProducerHooks hooks_for(const ShardFolder& folder, Output& out) {
    const auto progress = [&, before = -1](int there) mutable {
        if (before < 0) before = there;  // the time left is estimated from new trajectories only
        out.progress("trajectories", there - before, folder.trajectories() - before,
                     before > 0 ? fmt::format("{} existed before", before) : "");
    };
    const auto stop_if_asked = [&folder, calls = std::make_shared<std::atomic<int>>(0)] {
        pass_test_point("frames of trajectories", ++*calls);
        if (interrupted())
            throw Interrupted(fmt::format("{} of {} trajectories are kept in {}; the same command continues",
                                          folder.count(), folder.trajectories(), folder.path().string()));
    };
    return {.warn = [&out](const std::string& line) { out.warning(line); },
            .progress = progress,
            .stop_if_asked = stop_if_asked};
}

/// Whether trajectories are drawn from a scene; else from the recipes of a body.
bool is_scene(const DatasetArguments& arguments) { return has_extension(arguments.source, ".json"); }

/// Throws where an option is of the other kind of dataset.
void check_options(const DatasetArguments& arguments) {
    const auto refuse_all = [&](std::initializer_list<const char*> options, const char* why) {
        for (const char* option : options)
            if (arguments.command->count(option) > 0) throw CLI::ValidationError(option, why);
    };
    if (is_scene(arguments))
        refuse_all({"--recipe", "--strength", "--frame-interval", "--steps-per-frame", "--contact-edges"},
                   "is for the recipes of a body, but this dataset is drawn from a scene");
    else
        refuse_all({"--body", "--values"}, "is for scenes (.json), but this dataset is of a body");
}

/// Reads the body, or the scene and the body whose poses it records.
Body load_source(const DatasetArguments& arguments, DatasetPlan& plan) {
    if (!is_scene(arguments)) return load_body(arguments.source);
    SceneTemplate scene = load_template(arguments.source);
    const SceneDataset config{
        .body = arguments.recorded, .frames = arguments.frames, .seed = plan.excitation.seed};
    try {
        plan.scene = std::make_shared<const SceneTrajectories>(std::move(scene), config);
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format("{}: {}", arguments.source, error.what()));
    }
    return plan.scene->body();
}

/// Writes the card and the tables of a merged dataset. Every rank does, since any other may have been killed.
void write_summaries(const DatasetArguments& arguments, const ShardFolder& folder, const Body& body,
                     const std::filesystem::path& body_file) {
    write_card(folder, body, body_file.filename().string(), arguments.licence);
    if (!arguments.values.empty()) write_text(arguments.values, value_table(RecordingReader(folder.view())));
    write_text(arguments.csv, to_csv(variety_from_json(read_dataset_manifest(folder.view()).variety)));
}

void report(const DatasetArguments& arguments, const ShardFolder& folder, const Body& body,
            const Output& out) {
    const DatasetManifest manifest = read_dataset_manifest(folder.view());
    const auto nodes = body.tets.X.rows();
    const Variety variety = variety_from_json(manifest.variety);
    int failed = 0;
    for (const auto& [name, kind] : variety.kinds) failed += kind.failed;
    out.text(fmt::format("{}: {} in {}, {} of {}, {} failed", arguments.output,
                         counted_trajectories(folder.trajectories()), counted(folder.shards(), "file"),
                         counted(variety.all.frames, "frame"), counted(nodes, "node"), failed));
    out.text(to_text(variety));
    out.result({{"trajectories", folder.trajectories()},
                {"shards", folder.shards()},
                {"frames", variety.all.frames},
                {"nodes", nodes},
                {"failed", failed},
                {"variety", nlohmann::ordered_json::parse(manifest.variety)}});
    if (failed == folder.trajectories())
        throw std::runtime_error(fmt::format(
            "{}: every trajectory failed, so there is nothing to train on; nbdtree inspect says why, "
            "shorter steps or weaker forces may help",
            arguments.output));
}

void run(const DatasetArguments& arguments, Output& out) {
    const Shard shard = parse_shard(arguments.shard);
    check_options(arguments);
    const Rank rank = this_rank();
    if (rank.number > 0) {  // only rank 0 prints
        out.quiet = true;
        out.json = false;
    }
    check_outputs({{"dataset", arguments.output, ".h5"},
                   {"csv", arguments.csv, ".csv"},
                   {"values", arguments.values, ".csv"}},
                  {arguments.source, arguments.recipe});
    DatasetPlan plan = arguments.plan;
    plan.excitation.ranges = load_ranges(arguments);
    if (arguments.frames) plan.excitation.frames = *arguments.frames;
    hold_blas_to_one_thread();
    if (const BlasInfo blas = blas_info(); !blas.fast) out.warning(blas.warning);
    out.work("reading the body");
    const Body body = load_source(arguments, plan);
    if (plan.scene) plan.excitation.frames = plan.scene->frames();
    if (rank.number == 0)
        for (const std::string& hint : body_hints(body))
            out.warning(fmt::format("{}: {}", arguments.source, hint));

    finish_on_interrupt();
    const ShardFolder folder(arguments.output, plan.trajectories, plan.per_shard);
    if (shard.number >= plan.trajectories)
        throw std::invalid_argument(
            fmt::format("shard {} of {} trajectories is empty", arguments.shard, plan.trajectories));
    check_trajectories(plan, body);
    check_hold_out(plan, body);
    begin_dataset(folder, plan_json(plan, body));
    say_on_interrupt(fmt::format("the trajectories done are kept in {}; the same command continues",
                                 folder.path().string()));
    out.work("checking what is there");
    Producer producer(body, plan, folder, hooks_for(folder, out));

    const bool alone = shard.count == 1 && rank.count == 1;
    const int processes = shard.count * rank.count, process = shard.number * rank.count + rank.number;
    const std::filesystem::path trained =
        plan.scene ? plan.scene->body_file(folder.path()) : std::filesystem::path(arguments.source);
    producer.verify([&](int g) { return alone || g % processes == process; });
    const auto mine = [&](int index) { return index % shard.count == shard.number; };
    const int threads = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    const int start = std::int64_t{plan.trajectories} * rank.number / rank.count;
    const auto merge = [&] {
        out.work("merging");
        return producer.merge();
    };
    do producer.produce(mine, threads, start);
    while (arguments.shard.empty() && !merge());

    if (arguments.shard.empty()) {
        write_summaries(arguments, folder, body, trained);
        if (rank.number == 0) report(arguments, folder, body, out);
        if (plan.scene)
            out.text(fmt::format("poses are of the body {}, for nbdtree train", trained.string()));
        return;
    }
    out.text(
        fmt::format("{}: shard {} is done, {} of {} trajectories exist; the command without --shard "
                    "makes what is missing and merges",
                    folder.path().string(), arguments.shard, folder.count(), plan.trajectories));
    out.result({{"shard", arguments.shard}, {"there", folder.count()}, {"trajectories", plan.trajectories}});
}

/// How each trajectory moves.
void add_motion_options(CLI::App& command, DatasetArguments& arguments) {
    ExcitationConfig& excitation = arguments.plan.excitation;
    command
        .add_option(
            "--frames", arguments.frames,
            fmt::format("Frames per trajectory; default: {}, or those of the scene", excitation.frames))
        ->check(whole_number(1, 1'000'000));
    command.add_option("--seed", excitation.seed, "Trajectory i depends on the seed and on i alone")
        ->check(seed_check());
    command
        .add_option("--strength", arguments.strength,
                    "Strength of the motion, instead of the recipe's; 1: local strains of 20 to 50 %")
        ->check(number_check("> 0 and at most 1000", [](double x) { return x > 0 && x <= 1000; }));
    command
        .add_option("--frame-interval", excitation.frame_interval,
                    "Seconds between frames; 0: a fifth of the time in which sound crosses the body")
        ->check(not_negative());
    command.add_option("--steps-per-frame", excitation.steps_per_frame, "Time steps per frame")
        ->check(whole_number(1, 1000));
}

/// Which trajectories training must not see.
void add_split_options(CLI::App& command, DatasetPlan& plan) {
    command
        .add_option("--held-out", plan.held_out_share, "Share of the trajectories that training must not see")
        ->check(number_check(">= 0 and < 1", [](double x) { return x >= 0 && x < 1; }));
    command
        .add_option(
            "--hold-out", plan.hold_out,
            "Also store a split by a parameter of the recipes: kind=thrown,drop holds out these "
            "kinds, velocity=0.5..2 a range, velocity_gradient=top:0.2 those with the largest values; "
            "variables.NAME is a variable of a scene")
        ->check(CLI::Validator(
            [](const std::string& rule) {
                try {
                    parse_hold_out(rule);
                } catch (const std::invalid_argument& error) {
                    return std::string(error.what());
                }
                return std::string();
            },
            "RULE"));
}

}  // namespace

void add_dataset(CLI::App& app, Output& out) {
    const auto [command, arguments] =
        add_command<DatasetArguments>(app, out, "dataset",
                                      "Simulates trajectories for training; alone, under mpirun, or in "
                                      "job arrays. The same command continues an interrupted run",
                                      run);
    DatasetPlan& plan = arguments.plan;
    arguments.command = &command;
    command.add_option("BODY", arguments.source, "Body file, or scene with variables (.json)")->required();
    command
        .add_option("-o,--output", arguments.output,
                    "Dataset to write; the frames go to a folder of the same name with .shards")
        ->required();
    command.add_option(
        "--body", arguments.recorded,
        "Of a scene: name of the body whose poses are recorded; of several with the name, each in "
        "its turn");
    command.add_option("--values", arguments.values,
                       "Of a scene: file for the values of its variables, one line per trajectory (CSV)");
    command.add_option("--recipe", arguments.recipe,
                       "JSON file that describes what happens in the trajectories, see assets/recipes");
    command.add_option("--trajectories", plan.trajectories, "Number of trajectories")
        ->check(whole_number(1, 1'000'000));
    add_motion_options(command, arguments);
    command
        .add_option("--attempts", plan.attempts,
                    "Maximum attempts per trajectory; each one after a failure halves the time step")
        ->check(whole_number(1, 8));
    add_split_options(command, plan);
    add_extras_options(command, plan.extras);
    command.add_option("--per-shard", plan.per_shard, "Trajectories per file")
        ->check(whole_number(1, 1'000'000));
    command.add_option(
        "--shard", arguments.shard,
        "i/N: only trajectories i, i + N, i + 2 N, ...; merge with the same command without it");
    command.add_option("--licence", arguments.licence,
                       "What the dataset's card, README.md beside the frames, says of its licence");
    command.add_option("--csv", arguments.csv,
                       "File for the spread of the modal coordinates, one line per mode (CSV)");
}

}  // namespace nbd
