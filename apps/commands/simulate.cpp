#include "apps/cli/option_checks.hpp"
#include "apps/commands/commands.hpp"
#include "apps/simulate/reaction_table.hpp"
#include "apps/simulate/run_loop.hpp"

namespace nbd {
namespace {

void add_scene_options(CLI::App& command, SimulateOptions& options) {
    command
        .add_option_function<std::string>(
            "--bounds", [&options](const std::string& text) { options.bounds = bound_kind(text); },
            "Bounds of all bodies, instead of the scene's")
        ->check(bounds_name());
    command
        .add_option("--margin", options.margin, "Share added to the bounds' radii, instead of the scene's")
        ->check(between(0, 10));
    command.add_option("--frames", options.frames, "Number of frames, instead of the scene's")
        ->check(whole_number(1, 10'000'000));
    command
        .add_option("--trajectory", options.draw.trajectory,
                    "Of a scene with variables: which of the trajectories that nbdtree dataset draws")
        ->check(not_negative_whole());
    command
        .add_option("--seed", options.draw.seed,
                    "Of a scene with variables: the seed of the draw; default: 1")
        ->check(seed_check());
    command
        .add_option(
            "--draw", options.draw.again,
            "Of a scene with variables: how often the values are drawn again, as a dataset's recipe has it")
        ->check(not_negative_whole());
    command
        .add_option(
            "--set", options.draw.set,
            "Of a scene with variables: NAME=VALUE, a value instead of the drawn one; may be repeated")
        ->type_name("NAME=VALUE")
        ->allow_extra_args(false);
    command
        .add_option("--audit", options.audit,
                    "Every N-th frame, count the face pairs that the scene's bounds miss; 0: never")
        ->check(not_negative_whole());
}

void add_outputs(CLI::App& command, SceneOutput& output) {
    command.add_option("-o,--output", output.recording,
                       "Recording to write, one trajectory per body; needed unless the scene names one");
    command.add_option("--csv", output.csv,
                       "File with one line per step (CSV): contacts, iterations, costs, energies");
    command.add_option(
        "--reactions", output.reactions,
        "File with the forces and torques of pins, grips, obstacles and other bodies, a line for "
        "each in every step (CSV)");
    command.add_option("--vtu", output.vtu, "Folder for frames that ParaView opens (scene.pvd)");
    command.add_option("--obj", output.obj, "Folder for the bodies' surfaces, one file per frame and body");
    command.add_option("--picture", output.picture, "PNG file with six frames");
}

void add_live_options(CLI::App& command, SimulateOptions& options) {
    CLI::Option* live =
        command
            .add_option_function<std::string>(
                "--live",
                [&options](const std::string& text) { options.live = text.empty() ? 0 : std::stoi(text); },
                "Serve a page that shows the run while it goes on, at this PORT of "
                "127.0.0.1, or at any that is free")
            ->expected(0, 1)
            ->type_name("[PORT]")
            ->check(port_number());
    command
        .add_flag("--keep-live", options.keep_live,
                  "Go on serving the page after the end of the run, until Ctrl-C")
        ->needs(live);
}

/// For the end of --help.
std::string columns() {
    std::string text = "Columns of --csv, one line per step:\n  frame: that the step belongs to";
    for (const StepNumber& number : step_numbers)
        text += fmt::format("\n  {}{}: {}", number.name, *number.unit ? fmt::format(", {}", number.unit) : "",
                            number.text);
    text += "\nand in the last step of a frame that --audit looks at:";
    for (const AuditNumber& number : audit_numbers) text += fmt::format("\n  {}", number.name);
    return text +
           fmt::format("\nColumns of --reactions, means over the step in N and N m about the origin:\n  {}",
                       ReactionTable::columns());
}

void run(const SimulateOptions& options, Output& out) { RunLoop(options, out).run(); }

}  // namespace

void add_simulate(CLI::App& app, Output& out) {
    const auto [command, options] =
        add_command<SimulateOptions>(app, out, "simulate", "Simulates a scene of deformable bodies", run);
    command.footer(columns());
    command.add_option("SCENE", options.scene, "Scene file, JSON")->required();
    add_scene_options(command, options);
    add_outputs(command, options.output);
    add_live_options(command, options);
    add_extras_options(command, options.extras);
    command.add_flag("--allow-outside", options.allow_outside,
                     "Let the scene name outputs outside of the recording's folder");
    command.add_flag("--resume", options.resume,
                     "Continue a run that was interrupted or killed; start one if there is none, and leave a "
                     "finished one as it is");
}

}  // namespace nbd
