#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <vector>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/threads/round_work.hpp"
#include "apps/bench/threads/scene_work.hpp"
#include "apps/cli/load_body.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "meshing/body/body.hpp"
#include "sim/factor/blas.hpp"

namespace nbd {
namespace {

struct ThreadsArguments {
    std::vector<std::string> scenes, training;  // training: a body and its recording
    std::string dataset, csv;                   // dataset: a body
    int trajectories = 32, frames = 20;         // of the dataset
    SceneWorkConfig config;
};

/// What was counted of each work that was asked for.
class ThreadTables {
 public:
    explicit ThreadTables(Output& out) : out_(out) {}

    /// times: of `steps` steps.
    void add(const std::string& name, const std::string& what, const WorkCount& count, int steps,
             const std::vector<MeasuredTimes>& times) {
        const Rows rows = thread_rows(name, count, steps, times);
        out_.text(fmt::format("{}: {}, {:.4g} ms each on one thread\n{}", name, what,
                              rows.front()["ms_1"].get<double>(), thread_text(rows)));
        rows_.insert(rows_.end(), rows.begin(), rows.end());
    }

    const Rows& rows() const noexcept { return rows_; }

 private:
    Output& out_;
    Rows rows_;
};

void run(const ThreadsArguments& arguments, Output& out) {
    hold_blas_to_one_thread();
    if (arguments.scenes.empty() && arguments.dataset.empty() && arguments.training.empty())
        throw CLI::ValidationError("threads", "nothing to count: name scenes, --dataset or --train");
    if (!arguments.csv.empty())
        check_output(arguments.csv, {arguments.scenes.begin(), arguments.scenes.end()}, ".csv");
    ThreadTables tables(out);
    const SceneWorkConfig& config = arguments.config;
    for (const std::string& file : arguments.scenes) {
        const std::string name = std::filesystem::path(file).stem().string();
        SceneSpec spec = load_scene(file);
        std::vector<LoadedBody> bodies = load_bodies(spec, out);
        make_trees(spec, bodies);
        WorkCount count;
        const auto progress = [&](int done, int total) { out.progress(name, done, total); };
        const auto times = count_scene(spec, bodies, config, progress, count);
        tables.add(name, fmt::format("{} steps after {}", config.steps, config.skip), count, config.steps,
                   times);
    }
    if (!arguments.dataset.empty()) {
        out.work("dataset");
        const Body body = load_body(arguments.dataset);
        WorkCount count;
        const auto round = [&](int threads) {
            make_dataset_round(body, arguments.trajectories, arguments.frames, threads);
        };
        const auto times = count_rounds(round, config.repeats, count);
        tables.add("dataset",
                   fmt::format("{} trajectories of {} frames", arguments.trajectories, arguments.frames),
                   count, 1, times);
    }
    if (!arguments.training.empty()) {
        out.work("training");
        const Body body = load_body(arguments.training.at(0));
        WorkCount count;
        const auto round = [&](int) { make_training_round(body, arguments.training.at(1), TrainConfig{}); };
        const auto times = count_rounds(round, config.repeats, count);
        tables.add("training", "training and calibration", count, 1, times);
    }
    if (!arguments.csv.empty()) write_csv(arguments.csv, tables.rows());
    out.result({{"rows", tables.rows()}});
}

}  // namespace

void add_bench_threads(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<ThreadsArguments>(
        app, out, "threads",
        "Counts how many times faster work may be on more threads, beside what is measured here", run);
    command.add_option("SCENES", arguments.scenes, "Scene files, whose steps are counted");
    command.add_option("--dataset", arguments.dataset, "A body, of which a dataset is simulated");
    command.add_option("--trajectories", arguments.trajectories, "Of the dataset")
        ->check(whole_number(1, 100'000));
    command.add_option("--frames", arguments.frames, "Of each trajectory of the dataset")
        ->check(whole_number(1, 100'000));
    command.add_option("--train", arguments.training, "A body and its recording, of which a tree is trained")
        ->expected(2);
    command.add_option("--steps", arguments.config.steps, "Steps that are counted")
        ->check(whole_number(1, 100'000));
    command.add_option("--skip", arguments.config.skip, "Steps before them")
        ->check(whole_number(1, 1'000'000));
    command
        .add_option("--repeats", arguments.config.repeats,
                    "How often all is recorded; the shortest time of each part counts")
        ->check(whole_number(1, 100));
    command.add_option("-o,--output", arguments.csv, "Table to write, CSV");
    command.footer(
        "One thread does the work, and the time of each task of its parallel loops is recorded. Counted is\n"
        "how long other numbers of threads would take if starting a task cost nothing and threads did not\n"
        "slow each other down: an upper bound of what a machine reaches.\n"
        "loop: tasks of a loop; serial: what waits for all before it and lets all after it wait");
}

}  // namespace nbd
