#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "apps/cli/interrupt.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/commands/commands.hpp"
#include "apps/live/live_run.hpp"
#include "apps/simulate/audit.hpp"
#include "apps/simulate/contact_comparison.hpp"
#include "apps/simulate/finished_run.hpp"
#include "apps/simulate/journal.hpp"
#include "apps/simulate/run_paths.hpp"
#include "apps/simulate/run_report.hpp"
#include "apps/simulate/scene_files.hpp"
#include "apps/simulate/simulation_outputs.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/h5/sha256.hpp"
#include "meshing/h5/version.hpp"
#include "meshing/surface/counted.hpp"
#include "sim/factor/blas.hpp"
#include "training/files/recording.hpp"
#include "training/files/split.hpp"

namespace nbd {
namespace {

struct SimulateArguments {
    std::string scene, bounds;
    SceneOutput output;
    std::optional<double> margin;
    std::optional<int> frames;
    std::optional<int> per_group;
    int audit = 0;
    std::optional<int> live;  // port; 0: any
    bool keep_live = false;
    bool resume = false, compare = false, outside = false;
    ExtrasRequest extras;
};

/// Applies the options that override the scene file.
void override(SceneSpec& spec, const SimulateArguments& arguments) {
    if (spec.contact.intersection_free &&
        (arguments.compare || !arguments.bounds.empty() || arguments.margin || arguments.per_group))
        throw std::invalid_argument(
            fmt::format("{}: steps without intersections have no bounds and no contacts to choose; "
                        "allowed: without --bounds and --compare-contacts",
                        arguments.scene));
    for (SceneBody& body : spec.bodies) {
        if (!arguments.bounds.empty()) body.bounds = bound_kind(arguments.bounds);
        if (arguments.margin) body.margin = arguments.margin;
    }
    if (arguments.frames) spec.time.frames = *arguments.frames;
    if (arguments.per_group) spec.contact.per_group = *arguments.per_group;
}

/// The options that change what a run of the scene computes. spec: before the options override it.
RunOptions options_of(const SimulateArguments& arguments, const SceneSpec& spec) {
    const bool other_contacts =
        arguments.per_group.value_or(spec.contact.per_group) != spec.contact.per_group;
    return {
        {"--bounds", arguments.bounds.empty() ? "" : std::string(name(bound_kind(arguments.bounds)))},
        {"--margin", arguments.margin ? fmt::format("{}", *arguments.margin) : ""},
        {"--audit", arguments.audit > 0 ? fmt::format("{}", arguments.audit) : ""},
        {"--contacts", other_contacts ? fmt::format("{}", *arguments.per_group) : ""},
    };
}

/// Whether an earlier run has done all. Warns of what is asked of a run that is not made.
bool is_finished(const SceneOutput& paths, const WantedRun& wanted, const SimulateArguments& arguments,
                 const Output& out) {
    const EarlierRun earlier = find_earlier_run(paths, wanted);
    if (!earlier.is_finished) return false;
    RunOptions idle = earlier.tells_options ? RunOptions() : wanted.options;
    idle.emplace_back("--live", arguments.live ? "given" : "");
    if (const std::string given = given_options(idle); !given.empty())
        out.warning(
            fmt::format("{}: the run is finished, so it ignores {}", paths.recording.string(), given));
    if (out.strict)
        if (const int frames = troubled_frames(RecordingReader(paths.recording)); frames > 0)
            throw std::runtime_error(fmt::format("{}: the run is finished, with {} of steps that went wrong",
                                                 paths.recording.string(), counted(frames, "frame")));
    return true;
}

/// Everything that determines what a run computes.
Journal::Facts facts_of(const RunOptions& options, const SceneSpec& spec) {
    Journal::Facts facts{
        {"program version", std::string(version())},
        {"scene", h5::text_sha256(spec.text)},
        {"--frames", fmt::format("{}", spec.time.frames)},
    };
    facts.insert(facts.end(), options.begin(), options.end());
    for (const std::filesystem::path& input : scene_inputs(spec))
        facts.emplace_back(input.filename().string(), h5::file_sha256(input));
    return facts;
}

/// Passes the frames of an earlier run to the outputs; returns the last one, if any.
std::optional<SimulationFrame> replay(Journal& journal, SimulationOutputs& outputs,
                                      std::optional<LiveRun>& live) {
    std::optional<SimulationFrame> last;
    while (const auto record = journal.next()) {
        last = frame_from(*record);
        outputs.add_frame(*last);
        if (live) live->add(*last);
    }
    return last;
}

/// Shows the end of a run that had frames for pages, and goes on serving if that was asked for.
void end_live(LiveRun& live, bool stopped, const std::string& failure, bool keep, const Output& out) {
    live.end(stopped ? RunState::stopped : failure.empty() ? RunState::done : RunState::failed, failure);
    if (!keep || stopped) return;
    out.announcement(fmt::format("the run has {}; {} shows it until Ctrl-C",
                                 failure.empty() ? "ended" : "failed: " + failure, live.url()));
    live.keep_serving();
}

void run(const SimulateArguments& arguments, Output& out) {
    hold_blas_to_one_thread();
    if (const BlasInfo blas = blas_info(); !blas.fast) out.warning(blas.warning);
    SceneSpec spec = load_scene(arguments.scene);
    const RunOptions options = options_of(arguments, spec);
    override(spec, arguments);
    std::vector<std::filesystem::path> inputs = scene_inputs(spec);
    inputs.push_back(arguments.scene);
    const SceneOutput paths = output_paths(arguments.output, spec.output, arguments.scene, arguments.outside);
    check_outputs(paths, inputs);
    if (arguments.resume && is_finished(paths, {spec, inputs, arguments.extras, options}, arguments, out)) {
        out.text(fmt::format("{}: is finished, nothing to continue; without --resume the scene runs anew",
                             paths.recording.string()));
        out.result({{"finished", true}});
        return;
    }
    std::optional<LiveRun> live;
    if (arguments.live) live.emplace(*arguments.live);
    const std::string continues =
        fmt::format("continue with: {}{}", out.command_line, arguments.resume ? "" : " --resume");
    std::optional<Journal> opened;
    const auto open_journal = [&] {
        opened.emplace(journal_path(paths), facts_of(options, spec), arguments.resume);
        say_on_interrupt(
            fmt::format("{} holds the frames done; {}", journal_path(paths).string(), continues));
    };
    // A new one has to wait, so that a run that is stopped while it loads leaves nothing behind.
    if (arguments.resume && std::filesystem::exists(journal_path(paths))) open_journal();

    out.work("loading");
    SceneFiles files;
    std::vector<LoadedBody> bodies;
    std::vector<std::string> hashes;
    for (const SceneBody& body : spec.bodies) {
        bodies.push_back(files.load(body, out));
        hashes.push_back(body_hash(*bodies.back().body));
    }
    make_trees(spec, bodies);
    std::vector<StartMove> moves;
    // Shared with the page of a run, which another thread makes.
    const auto shared_world = std::make_shared<World>(build_world(spec, bodies, &moves));
    World& world = *shared_world;
    tell_start(arguments.scene, spec, bodies, world, moves, out);
    world.check_start();
    std::optional<Audit> audit;
    if (arguments.audit > 0) audit.emplace(spec, bodies);
    std::optional<ContactComparison> comparison;
    if (arguments.compare) comparison.emplace(spec, bodies);
    if (live) live->begin(spec, bodies, shared_world, paths.recording.filename().string());
    finish_on_interrupt();
    if (!opened) open_journal();
    Journal& journal = *opened;
    bodies.clear();  // the world has its own copies of what it needs
    files = {};
    SimulationOutputs outputs(
        paths, spec, world, hashes,
        {.scene_file = arguments.scene, .options = run_options_text(options), .of_frames = arguments.extras});

    SimulationFrame frame;
    double output_us = 0;  // of the frames that this run made
    int frames_made = 0;
    const auto keep = [&](int number, std::vector<StepRow> steps) {
        const Stopwatch watch;
        frame = take_frame(number, world, std::move(steps));
        journal.append(to_bytes(frame));
        outputs.add_frame(frame);
        if (live) live->add(frame);
        output_us += watch.microseconds();
        ++frames_made;
    };
    if (auto last = replay(journal, outputs, live)) {
        frame = std::move(*last);
        world.restore(frame.world);
        out.text(fmt::format("{}: continues after frame {}", paths.recording.string(), frame.number));
    } else {
        keep(0, {});
    }
    if (live) out.announcement(fmt::format("{} shows the run", live->url()));
    std::string failure, trouble;  // the first trouble of this run
    if (out.strict && outputs.table().totals().troubled_steps > 0)
        failure = fmt::format("a step up to frame {} went wrong", frame.number);
    out.progress("frames", frame.number, spec.time.frames);
    int factorised = 0;  // number of steps
    while (frame.number < spec.time.frames && failure.empty() && !interrupted()) {
        const int number = frame.number + 1;
        std::vector<StepRow> steps;
        WorldReport report;
        for (int step = 0; step < spec.time.steps_per_frame && failure.empty(); ++step) {
            report = world.step(spec.time.dt);
            if (comparison) comparison->step(spec.time.dt);
            steps.push_back(step_row(number, report));
            failure = report.failure;
            if (trouble.empty() && report.trouble != StepTrouble::inverted) trouble = report.trouble_reason;
            if (out.strict && failure.empty()) failure = report.trouble_reason;
            if (!report.fallback.empty() && factorised++ == 0) {
                const std::string line = fmt::format("a linear system was factorised, {}", report.fallback);
                if (!out.strict)
                    out.warning(line);
                else if (failure.empty())
                    failure = line;
            }
        }
        if (!failure.empty()) {
            outputs.add_steps(steps);
            break;
        }
        if (audit && number % arguments.audit == 0) {
            steps.back().audited = true;
            steps.back().audit = audit->check(world);
        }
        if (comparison) comparison->compare(world, report);
        keep(number, std::move(steps));
        out.progress("frames", number, spec.time.frames);
    }
    if (factorised > 1) out.warning(fmt::format("linear systems were factorised in {} steps", factorised));
    outputs.finish(failure);
    const bool stopped = failure.empty() && frame.number < spec.time.frames;
    if (!stopped) journal.remove();
    // A strict run that met trouble ends with that as its error.
    if (!(out.strict && !failure.empty())) tell_trouble(outputs.table().totals(), trouble, out);
    tell_results(paths, frame.number, outputs.table().totals(), world.smallest_diagonal(),
                 output_us / std::max(frames_made, 1), out);
    if (comparison)
        out.text(fmt::format("compared with all contacts; distances of nodes in % of the smallest body:\n{}",
                             comparison->table(world.smallest_diagonal())));
    if (live) end_live(*live, stopped, failure, arguments.keep_live, out);
    if (!failure.empty())
        throw std::runtime_error(
            fmt::format("{}: stopped at {:.4g} s: {}", arguments.scene, world.time(), failure));
    if (stopped)
        throw Interrupted(fmt::format("{} holds the {} of {} frames done; {}", paths.recording.string(),
                                      frame.number, spec.time.frames, continues));
}

}  // namespace

void add_simulate(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<SimulateArguments>();
    CLI::App* command = app.add_subcommand("simulate", "Simulates a scene of deformable bodies");
    SceneOutput& output = arguments->output;
    command->add_option("SCENE", arguments->scene, "Scene file, JSON")->required();
    command->add_option("-o,--output", output.recording,
                        "Recording to write, one trajectory per body; needed unless the scene names one");
    command->add_option("--bounds", arguments->bounds, "Bounds of all bodies, instead of the scene's")
        ->check(bounds_name());
    command
        ->add_option("--margin", arguments->margin,
                     "Share added to the bounds' radii, instead of the scene's")
        ->check(between(0, 10));
    command->add_option("--frames", arguments->frames, "Number of frames, instead of the scene's")
        ->check(whole_number(1, 10'000'000));
    command
        ->add_option("--audit", arguments->audit,
                     "Every N-th frame, count the face pairs that the scene's bounds miss; 0: never")
        ->capture_default_str()
        ->check(not_negative_whole());
    command
        ->add_option("--contacts", arguments->per_group,
                     "Contacts kept of those that the same two nodes carry, instead of the scene's; 0: all")
        ->check(whole_number(0, 1000));
    command->add_option("--csv", output.csv,
                        "File with one line per step (CSV): contacts, iterations, costs, energies");
    command->add_option("--vtu", output.vtu, "Folder for frames that ParaView opens (scene.pvd)");
    command->add_option("--obj", output.obj, "Folder for the bodies' surfaces, one file per frame and body");
    command->add_option("--picture", output.picture, "PNG file with six frames");
    CLI::Option* live = command
                            ->add_option_function<std::string>(
                                "--live",
                                [arguments](const std::string& text) {
                                    arguments->live = text.empty() ? 0 : std::stoi(text);
                                },
                                "Serve a page that shows the run while it goes on, at this PORT of "
                                "127.0.0.1, or at any that is free")
                            ->expected(0, 1)
                            ->type_name("[PORT]")
                            ->check(port_number());
    command
        ->add_flag("--keep-live", arguments->keep_live,
                   "Go on serving the page after the end of the run, until Ctrl-C")
        ->needs(live);
    add_extras_options(*command, arguments->extras);
    command->add_flag("--allow-outside", arguments->outside,
                      "Let the scene name outputs outside of the recording's folder");
    CLI::Option* resume =
        command->add_flag("--resume", arguments->resume,
                          "Continue a run that was interrupted or killed; start one if there is none, and "
                          "leave a finished one as it is");
    command
        ->add_flag(
            "--compare-contacts", arguments->compare,
            "Run the scene a second time beside it, with all contacts, and print how far they come apart")
        ->excludes(resume);
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
