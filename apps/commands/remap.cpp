#include <fmt/core.h>

#include <algorithm>
#include <memory>

#include "apps/cli/load_body.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/commands/commands.hpp"
#include "meshing/body/body.hpp"
#include "meshing/surface/counted.hpp"
#include "training/files/recording.hpp"
#include "training/files/recording_hash.hpp"

namespace nbd {
namespace {

struct RemapArguments {
    std::string recording, output, from, to;
    int trajectories = 0;
};

void copy_frames(const RecordingReader& from, int trajectory, RecordingWriter& to,
                 const TrajectoryInfo& info) {
    constexpr int frames_at_once = 32;
    const std::vector<double> times = from.times(trajectory);
    FrameContents contents = from.contents(trajectory);
    contents.contact_edges.reset();  // of the other surface
    const int nodes = from.nodes(trajectory), handle = to.begin_trajectory(info, nodes, contents);
    Vertices x;
    for (int begin = 0; begin < info.frames; begin += frames_at_once) {
        const int count = std::min(frames_at_once, info.frames - begin);
        from.read(trajectory, begin, count, x);
        std::vector<FrameExtras> extras = from.read_extras(trajectory, begin, count);
        for (int i = 0; i < count; ++i) {
            FrameExtras& more = extras[static_cast<std::size_t>(i)];
            more.contact_edges.clear();
            to.add_frame(handle, times[static_cast<std::size_t>(begin + i)], x.middleRows(nodes * i, nodes),
                         more);
        }
    }
    FrameFacts facts = from.facts(trajectory);
    facts.self_intersections.clear();  // of the other surface
    to.end_trajectory(handle, info.failure, facts);
}

void run(const RemapArguments& arguments, Output& out) {
    check_output(arguments.output, {arguments.recording, arguments.from, arguments.to});
    out.work("reading");
    const Body from = load_body(arguments.from), to = load_body(arguments.to);
    check_same_tets(arguments.to, to.tets, arguments.from, from.tets);
    const std::string from_hash = body_hash(from), to_hash = body_hash(to);
    const RecordingReader recording(arguments.recording);
    const auto& infos = recording.trajectories();
    const auto all = static_cast<int>(infos.size());
    const int count = arguments.trajectories > 0 ? std::min(arguments.trajectories, all) : all;

    RecordingWriter writer(arguments.output);
    writer.label("remapped_from_sha256", recording_hash(recording));
    int frames = 0;
    for (int i = 0; i < count; ++i) {
        TrajectoryInfo info = infos[static_cast<std::size_t>(i)];
        if (info.body_hash != from_hash)
            throw std::runtime_error(fmt::format("{}: trajectory {} was not recorded from {}",
                                                 arguments.recording, info.id, arguments.from));
        info.body_hash = to_hash;
        copy_frames(recording, i, writer, info);
        frames += info.frames;
        out.progress("trajectories", i + 1, count);
    }
    writer.finish();
    out.text(
        fmt::format("{}: {} of {}", arguments.output, counted(frames, "frame"), counted_trajectories(count)));
    out.result({{"trajectories", count}, {"frames", frames}});
}

}  // namespace

void add_remap(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<RemapArguments>();
    CLI::App* command = app.add_subcommand(
        "remap", "Remaps a recording to a body with the same tetrahedra and another surface");
    command->add_option("DATA", arguments->recording, "Recording")->required();
    command->add_option("--from", arguments->from, "Body that was recorded")->required();
    command->add_option("--to", arguments->to, "Body with a finer or coarser surface")->required();
    command->add_option("-o,--output", arguments->output, "Recording to write")->required();
    command
        ->add_option("--trajectories", arguments->trajectories,
                     "Number of trajectories, starting with the first; 0: all")
        ->capture_default_str()
        ->check(CLI::Range(0, 100'000'000));
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
