#include <algorithm>
#include <memory>
#include <optional>

#include "apps/cli/interrupt.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/cli/scene_files.hpp"
#include "apps/commands/commands.hpp"
#include "apps/simulate/bounds_race.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "meshing/surface/counted.hpp"
#include "sim/factor/blas.hpp"

namespace nbd {
namespace {

struct RaceArguments {
    std::string scene, csv;
    std::vector<std::string> bounds;
    std::optional<int> frames;
    int audit = 1;
};

std::vector<BoundKind> chosen_bounds(const RaceArguments& arguments, const SceneSpec& spec,
                                     const std::vector<LoadedBody>& bodies) {
    std::vector<BoundKind> kinds;
    for (const std::string& name : arguments.bounds) kinds.push_back(bound_kind(name));
    if (arguments.bounds.empty())
        std::ranges::copy_if(bound_kinds, std::back_inserter(kinds),
                             [&](BoundKind kind) { return can_have(spec, bodies, kind); });
    for (const BoundKind kind : kinds)
        if (!can_have(spec, bodies, kind))
            throw std::invalid_argument(
                fmt::format("{}: a body cannot have {} bounds: these need {}", arguments.scene, name(kind),
                            kind == BoundKind::affine ? "weights that are not negative"
                                                      : "a tree file that holds them, and scale 1"));
    return kinds;
}

nlohmann::ordered_json to_json(const BoundsRace::Row& row) {
    const StepTotals& t = row.totals;
    return {{"bounds", name(row.bounds)},
            {"update_us", t.mean(&StepReport::update_us)},
            {"collision_us", t.mean(&StepReport::collision_us)},
            {"detect_us", t.mean(&StepReport::detect_us)},
            {"step_us", t.step_us()},
            {"nodes_bounded", t.mean(&StepReport::nodes_bounded)},
            {"audited_frames", t.audited_frames},
            {"intersecting_pairs", t.audit.intersecting},
            {"intersecting_pairs_missed", t.audit.intersecting_missed},
            {"near_pairs", t.audit.near},
            {"near_pairs_missed", t.audit.near_missed},
            {"farthest", row.farthest}};
}

void run(const RaceArguments& arguments, Output& out) {
    hold_blas_to_one_thread();
    SceneSpec spec = load_scene(arguments.scene);
    if (spec.contact.intersection_free)
        throw std::invalid_argument(
            fmt::format("{}: bounds play no part in steps without intersections; allowed: another scene",
                        arguments.scene));
    if (arguments.frames) spec.time.frames = *arguments.frames;
    std::vector<std::filesystem::path> inputs = scene_inputs(spec);
    inputs.push_back(arguments.scene);
    if (!arguments.csv.empty()) check_output(arguments.csv, inputs, ".csv");

    out.work("loading");
    SceneFiles files;
    std::vector<LoadedBody> bodies;
    for (const SceneBody& body : spec.bodies) bodies.push_back(files.load(body, out));
    const std::vector<BoundKind> kinds = chosen_bounds(arguments, spec, bodies);
    SceneSpec any = spec;
    for (SceneBody& body : any.bodies) body.bounds = BoundKind::automatic;
    make_trees(any, bodies);  // serve all kinds
    BoundsRace race(spec, bodies, kinds);
    finish_on_interrupt();
    out.progress("frames", 0, spec.time.frames);
    for (int frame = 1; frame <= spec.time.frames; ++frame) {
        if (interrupted())
            throw Interrupted(
                fmt::format("{}: {} of {} frames done; nothing was written, the same command starts anew",
                            arguments.scene, frame - 1, spec.time.frames));
        race.run_frame(arguments.audit > 0 && frame % arguments.audit == 0);
        out.progress("frames", frame, spec.time.frames);
    }
    const auto rows = race.rows();
    out.text(fmt::format("{}: {}, {}; means per step; apart: from the first run, % of the smallest body\n{}",
                         arguments.scene, counted(spec.time.frames, "frame"),
                         counted(rows.front().totals.steps, "step"), to_text(rows, race.size())));
    if (!arguments.csv.empty()) {
        h5::AtomicFile file(arguments.csv);
        file.out() << to_csv(rows);
        file.commit();
    }
    nlohmann::ordered_json table = nlohmann::ordered_json::array();
    for (const BoundsRace::Row& row : rows) table.push_back(to_json(row));
    out.result({{"frames", spec.time.frames}, {"smallest_body", race.size()}, {"bounds", table}});
}

}  // namespace

void add_race(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<RaceArguments>();
    CLI::App* command = app.add_subcommand(
        "race",
        "Runs a scene once with each kind of bounds, in turns, and tables what each costs and misses");
    command->add_option("SCENE", arguments->scene, "Scene file, JSON")->required();
    command
        ->add_option("--bounds", arguments->bounds,
                     "Bounds to run with, separated by commas; default: all that every body can have")
        ->delimiter(',')
        ->check(bounds_name());
    command->add_option("--frames", arguments->frames, "Number of frames, instead of the scene's")
        ->check(whole_number(1, 10'000'000));
    command
        ->add_option("--audit", arguments->audit,
                     "Every N-th frame, count the face pairs that bounds miss, of bounds that can; 0: never")
        ->capture_default_str()
        ->check(not_negative_whole());
    command->add_option("--csv", arguments->csv, "File for the table (CSV)");
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
