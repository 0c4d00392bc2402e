#include <fmt/core.h>

#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/cli/remap_recording.hpp"
#include "apps/commands/commands.hpp"
#include "meshing/body/body.hpp"
#include "meshing/surface/counted.hpp"

namespace nbd {
namespace {

struct RemapArguments {
    std::string recording, output, from, to;
    int trajectories = 0;
};

void run(const RemapArguments& arguments, Output& out) {
    check_output(arguments.output, {arguments.recording, arguments.from, arguments.to}, ".h5");
    out.work("remapping");
    Body from = load_body(arguments.from), to = load_body(arguments.to);
    from.name = arguments.from;  // for messages
    to.name = arguments.to;
    const RemappedFrames remapped =
        remap_recording(arguments.recording, from, to, arguments.output, arguments.trajectories);
    out.text(fmt::format("{}: {} of {}", arguments.output, counted(remapped.frames, "frame"),
                         counted_trajectories(remapped.trajectories)));
    out.result({{"trajectories", remapped.trajectories}, {"frames", remapped.frames}});
}

}  // namespace

void add_remap(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<RemapArguments>(
        app, out, "remap", "Remaps a recording to a body with the same tetrahedra and another surface", run);
    command.add_option("DATA", arguments.recording, "Recording")->required();
    command.add_option("--from", arguments.from, "Body that was recorded")->required();
    command.add_option("--to", arguments.to, "Body with a finer or coarser surface")->required();
    command.add_option("-o,--output", arguments.output, "Recording to write")->required();
    command
        .add_option("--trajectories", arguments.trajectories,
                    "Number of trajectories, starting with the first; 0: all")
        ->check(whole_number(0, 100'000'000));
}

}  // namespace nbd
