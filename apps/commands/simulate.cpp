#include <fmt/core.h>

#include <fstream>
#include <memory>
#include <optional>
#include <sstream>

#include "apps/audit.hpp"
#include "apps/commands/commands.hpp"
#include "apps/film.hpp"
#include "apps/interrupt.hpp"
#include "apps/load.hpp"
#include "apps/option_checks.hpp"
#include "apps/scene_files.hpp"
#include "apps/step_table.hpp"
#include "sim/blas.hpp"
#include "sim/scene.hpp"
#include "sim/vtu.hpp"
#include "training/recording.hpp"

namespace nbd {
namespace {

struct SimulateArguments {
    std::string scene, output, vtu, csv, picture, bounds;
    std::optional<double> margin;
    std::optional<int> frames;
    int audit = 0;
};

/// What the command line says instead of the scene file.
void override(SceneSpec& spec, const SimulateArguments& arguments) {
    for (SceneBody& body : spec.bodies) {
        if (!arguments.bounds.empty()) body.bounds = bound_kind(arguments.bounds);
        if (arguments.margin) body.margin = *arguments.margin;
    }
    if (arguments.frames) spec.time.frames = *arguments.frames;
}

/// Every file that a run reads.
std::vector<std::filesystem::path> inputs(const SimulateArguments& arguments, const SceneSpec& spec) {
    std::vector<std::filesystem::path> files = scene_inputs(spec);
    files.push_back(arguments.scene);
    return files;
}

std::string read_text(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
}

/// Everything that a run writes, frame by frame.
class Results {
 public:
    Results(const SimulateArguments& arguments, const SceneSpec& spec, const std::vector<LoadedBody>& bodies)
        : arguments_(arguments), recording_(arguments.output), film_(spec.time.frames + 1, 6) {
        const std::string text = read_text(arguments.scene);
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            TrajectoryInfo info;
            info.id = static_cast<int>(i);
            info.seed = spec.seed;
            info.body_hash = body_hash(bodies[i].body);
            info.recipe = text;
            handles_.push_back(
                recording_.begin_trajectory(info, static_cast<int>(bodies[i].body.tets.X.rows())));
        }
        if (!arguments.vtu.empty()) vtu_.emplace(arguments.vtu, "scene");
    }

    void add_frame(int frame, World& world) {
        std::vector<VtuBody> grids;
        for (int i = 0; i < world.body_count(); ++i) {
            const BodyState& state = world.state(i);
            recording_.add_frame(handles_[static_cast<std::size_t>(i)], world.time(), state.x.cast<float>());
            grids.push_back({&world.elastic(i).rest(), &state.x, &state.v});
        }
        if (vtu_) vtu_->add_frame(world.time(), grids);
        if (!arguments_.picture.empty()) film_.add_frame(frame, world);
    }

    void finish(const StepTable& table, const std::string& failure) {
        for (const int handle : handles_) recording_.end_trajectory(handle, failure);
        recording_.finish();
        if (!arguments_.csv.empty()) table.write(arguments_.csv);
        if (!arguments_.picture.empty()) film_.write(arguments_.picture, 3);
    }

 private:
    const SimulateArguments& arguments_;
    RecordingWriter recording_;
    std::vector<int> handles_;
    std::optional<VtuSeries> vtu_;
    Film film_;
};

void tell(const SimulateArguments& arguments, const StepTable& table, Output& out) {
    const StepTotals total = table.totals();
    out.text(fmt::format(
        "{}: {} frames, {:.3f} s simulated; contacts in {} frames, deepest penetration {:.3g} m",
        arguments.output, table.frames(), total.time, total.frames_in_contact, total.deepest_penetration));
    out.text(fmt::format("broad phase a step: {:.1f} us update, {:.1f} us queries, {:.1f} nodes bounded",
                         total.update_us, total.collision_us, total.nodes_bounded));
    if (arguments.audit > 0)
        out.text(fmt::format(
            "audit of {} frames: {} of {} touching face pairs missed, {} of {} within contact distance",
            total.audited_frames, total.audit.intersecting_missed, total.audit.intersecting,
            total.audit.near_missed, total.audit.near));
    out.result({{"frames", table.frames()},
                {"time", total.time},
                {"frames_in_contact", total.frames_in_contact},
                {"deepest_penetration", total.deepest_penetration},
                {"update_us", total.update_us},
                {"collision_us", total.collision_us},
                {"nodes_bounded", total.nodes_bounded},
                {"audited_frames", total.audited_frames},
                {"intersecting_pairs", total.audit.intersecting},
                {"intersecting_pairs_missed", total.audit.intersecting_missed},
                {"near_pairs", total.audit.near},
                {"near_pairs_missed", total.audit.near_missed}});
}

void run(const SimulateArguments& arguments, Output& out) {
    finish_on_interrupt();
    hold_blas_to_one_thread();
    if (const BlasInfo blas = blas_info(); !blas.fast) out.warning(blas.warning);
    SceneSpec spec = load_scene(arguments.scene);
    override(spec, arguments);
    for (const std::string& path : {arguments.output, arguments.csv, arguments.picture})
        if (!path.empty()) check_output(path, inputs(arguments, spec));
    SceneFiles files;
    std::vector<LoadedBody> bodies;
    for (const SceneBody& body : spec.bodies) bodies.push_back(files.load(body, out));
    World world = build_world(spec, bodies);
    Audit audit(spec, bodies);
    Results results(arguments, spec, bodies);
    StepTable table;

    results.add_frame(0, world);
    std::string failure;
    for (int frame = 1; frame <= spec.time.frames && failure.empty() && !interrupted(); ++frame) {
        for (int step = 0; step < spec.time.steps_per_frame && failure.empty(); ++step) {
            const WorldReport report = world.step(spec.time.dt);
            table.add_step(report);
            failure = report.failure;
        }
        if (failure.empty()) results.add_frame(frame, world);
        if (arguments.audit > 0 && frame % arguments.audit == 0) table.add_audit(audit.check(world));
        table.end_frame();
        out.progress("frames", frame, spec.time.frames);
    }
    results.finish(table, failure);
    tell(arguments, table, out);
    if (!failure.empty())
        throw std::runtime_error(
            fmt::format("{}: stopped at {:.4g} s: {}", arguments.scene, world.time(), failure));
    if (interrupted())
        throw Interrupted(fmt::format("{} holds the {} frames done", arguments.output, table.frames()));
}

}  // namespace

void add_simulate(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<SimulateArguments>();
    CLI::App* command = app.add_subcommand("simulate", "Runs a scene of deformable bodies");
    command->add_option("SCENE", arguments->scene, "Scene file, JSON")->required();
    command->add_option("-o,--output", arguments->output, "Recording to write, one trajectory a body")
        ->required();
    command->add_option("--bounds", arguments->bounds, "Bounds of all bodies, instead of the scene's")
        ->check(bounds_name());
    command
        ->add_option("--margin", arguments->margin,
                     "Share added to the bounds' radii, instead of the scene's")
        ->check(between(0, 10));
    command->add_option("--frames", arguments->frames, "How many, instead of the scene's")
        ->check(CLI::Range(1, 10'000'000));
    command
        ->add_option("--audit", arguments->audit,
                     "Every N-th frame, count the face pairs that the scene's bounds miss; 0: never")
        ->capture_default_str()
        ->check(not_negative());
    command->add_option("--csv", arguments->csv, "A line a frame: contacts, costs, energies");
    command->add_option("--vtu", arguments->vtu, "Folder for frames that ParaView opens (scene.pvd)");
    command->add_option("--picture", arguments->picture, "PNG with six frames");
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
