#include <fmt/core.h>
#include <tbb/global_control.h>
#include <tbb/parallel_pipeline.h>

#include <memory>
#include <vector>

#include "apps/commands/commands.hpp"
#include "apps/interrupt.hpp"
#include "apps/load.hpp"
#include "apps/option_checks.hpp"
#include "meshing/body.hpp"
#include "sim/blas.hpp"
#include "sim/excitation.hpp"
#include "training/recording.hpp"

namespace nbd {
namespace {

struct DatasetArguments {
    std::string body, output, shard = "0/1";
    int trajectories = 40;
    ExcitationConfig excitation;
};

/// This machine's part of the trajectories: those with index % count == number.
struct Shard {
    int number = 0, count = 1;
};

Shard parse_shard(const std::string& text) {
    Shard shard;
    int used = 0;
    if (std::sscanf(text.c_str(), "%d/%d%n", &shard.number, &shard.count, &used) != 2 ||
        used != static_cast<int>(text.size()) || shard.count < 1 || shard.number < 0 ||
        shard.number >= shard.count)
        throw CLI::ValidationError("--shard", fmt::format("'{}' is not i/N with 0 <= i < N", text));
    return shard;
}

/// A trajectory that was simulated and waits for its turn to be written.
struct Trajectory {
    int index = 0;
    TrajectoryResult result;
    std::vector<double> times;
    std::vector<Vertices> frames;
};

std::shared_ptr<Trajectory> simulate(const Excitation& excitation, int index) {
    auto trajectory = std::make_shared<Trajectory>();
    trajectory->index = index;
    trajectory->result = excitation.run(index, [&](double time, const Nodes& x) {
        if (interrupted()) throw Interrupted("no recording was written");
        trajectory->times.push_back(time);
        trajectory->frames.push_back(x.cast<float>());
    });
    return trajectory;
}

void write(RecordingWriter& writer, const Trajectory& trajectory, const ExcitationConfig& config,
           const std::string& hash, int nodes) {
    TrajectoryInfo info;
    info.id = trajectory.index;
    info.seed = config.seed;
    info.body_hash = hash;
    info.recipe = trajectory.result.recipe;
    const int handle = writer.begin_trajectory(info, nodes);
    for (std::size_t i = 0; i < trajectory.frames.size(); ++i)
        writer.add_frame(handle, trajectory.times[i], trajectory.frames[i]);
    writer.end_trajectory(handle, trajectory.result.failure);
}

void run(const DatasetArguments& arguments, Output& out) {
    finish_on_interrupt();
    const Shard shard = parse_shard(arguments.shard);
    check_output(arguments.output, {arguments.body});
    hold_blas_to_one_thread();
    if (const BlasInfo blas = blas_info(); !blas.fast) out.warning(blas.warning);
    const Body body = load_body(arguments.body);
    const std::string hash = body_hash(body);
    const int nodes = static_cast<int>(body.tets.X.rows());
    const Excitation excitation(body, arguments.excitation);

    std::vector<int> mine;
    for (int i = shard.number; i < arguments.trajectories; i += shard.count) mine.push_back(i);
    if (mine.empty())
        throw std::invalid_argument(
            fmt::format("shard {} of {} trajectories has none", arguments.shard, arguments.trajectories));

    RecordingWriter writer(arguments.output);
    std::size_t next = 0;
    int written = 0, frames = 0, failed = 0;
    // Simulated in parallel, written in order: the file is the same on any number of threads. Trajectories
    // take unlike times, so some wait in memory for a slow one before them.
    const std::size_t in_flight =
        4 * tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    tbb::parallel_pipeline(
        in_flight,
        tbb::make_filter<void, int>(tbb::filter_mode::serial_in_order,
                                    [&](tbb::flow_control& control) {
                                        if (next == mine.size()) {
                                            control.stop();
                                            return 0;
                                        }
                                        return mine[next++];
                                    }) &
            tbb::make_filter<int, std::shared_ptr<Trajectory>>(
                tbb::filter_mode::parallel, [&](int index) { return simulate(excitation, index); }) &
            tbb::make_filter<std::shared_ptr<Trajectory>, void>(
                tbb::filter_mode::serial_in_order, [&](const std::shared_ptr<Trajectory>& trajectory) {
                    write(writer, *trajectory, arguments.excitation, hash, nodes);
                    frames += static_cast<int>(trajectory->frames.size());
                    if (const std::string& failure = trajectory->result.failure; !failure.empty()) {
                        ++failed;
                        out.warning(fmt::format("trajectory {} is left out: {}", trajectory->index, failure));
                    }
                    out.progress("trajectories", ++written, static_cast<double>(mine.size()));
                }));
    writer.finish();

    out.text(fmt::format("{}: {} trajectories, {} frames of {} nodes, {} failed", arguments.output,
                         mine.size(), frames, nodes, failed));
    out.result({{"trajectories", mine.size()}, {"frames", frames}, {"nodes", nodes}, {"failed", failed}});
}

}  // namespace

void add_dataset(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<DatasetArguments>();
    ExcitationConfig& excitation = arguments->excitation;
    CLI::App* command =
        app.add_subcommand("dataset", "Simulates trajectories that training poses are taken from");
    command->add_option("BODY", arguments->body, "Body file")->required();
    command->add_option("-o,--output", arguments->output, "Recording to write")->required();
    command->add_option("--trajectories", arguments->trajectories, "How many")
        ->capture_default_str()
        ->check(CLI::Range(1, 1'000'000));
    command->add_option("--frames", excitation.frames, "Frames a trajectory")
        ->capture_default_str()
        ->check(CLI::Range(1, 1'000'000));
    command->add_option("--seed", excitation.seed, "Trajectory i depends on the seed and on i alone")
        ->capture_default_str()
        ->check(seed_check());
    command->add_option("--strength", excitation.strength, "1: local strains of 20 to 50 %")
        ->capture_default_str()
        ->check(positive());
    command
        ->add_option("--frame-interval", excitation.frame_interval,
                     "Seconds between frames; 0: a fifth of the time in which sound crosses the body")
        ->capture_default_str()
        ->check(not_negative());
    command->add_option("--steps-per-frame", excitation.steps_per_frame, "Time steps a frame")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    command->add_option("--shard", arguments->shard, "i/N: only trajectories i, i + N, i + 2 N, ...")
        ->capture_default_str();
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
