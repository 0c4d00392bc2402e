#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <optional>
#include <stdexcept>
#include <utility>

#include "apps/cli/interrupt.hpp"
#include "apps/cli/load_body.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/commands/commands.hpp"
#include "apps/simulate/audit.hpp"
#include "apps/simulate/step_table.hpp"
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

SceneSpec with_bounds(SceneSpec spec, BoundKind kind) {
    for (SceneBody& body : spec.bodies) {
        body.bounds = kind;
        if (!can_miss(kind)) body.margin.reset();
    }
    return spec;
}

/// Whether all bodies of the scene can have bounds of this kind.
bool can_have(const SceneSpec& spec, const std::vector<LoadedBody>& bodies, BoundKind kind) {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const LoadedBody& body = bodies[b];
        if (is_exact(kind) || kind == BoundKind::automatic) continue;
        if (kind == BoundKind::affine) {
            if (body.body->W.nonZeros() > 0 && body.body->W.coeffs().minCoeff() < 0) return false;
        } else if (!body.tree || !has_bounds(*body.tree, kind) || spec.bodies[b].placement.scale != 1) {
            return false;
        }
    }
    return true;
}

/// The run of a scene with one kind of bounds; the scene's margins apply to those that can miss.
struct Racer {
    Racer(const SceneSpec& spec, const std::vector<LoadedBody>& bodies, BoundKind kind)
        : bounds(kind), world(build_world(spec, bodies, &moves)), audit(spec, bodies) {}

    BoundKind bounds;
    std::vector<StartMove> moves{};
    World world;
    Audit audit;
    StepTable table{};
};
using Racers = std::deque<Racer>;

/// Takes the steps of the next frame in every run. They take turns step by step, so that slow moments of the
/// machine hit all of them. audited: counts the pairs of faces that bounds miss, of kinds that can miss.
/// Throws std::runtime_error, naming the bounds, where a run fails.
void run_frame(Racers& racers, const SceneTime& time, int frame, bool audited) {
    std::vector<std::vector<StepRow>> rows(racers.size());
    for (int step = 0; step < time.steps_per_frame; ++step)
        for (std::size_t r = 0; r < racers.size(); ++r) {
            const WorldReport report = racers[r].world.step(time.dt);
            if (!report.failure.empty())
                throw std::runtime_error(fmt::format("with bounds \"{}\" the scene fails: {}",
                                                     name(racers[r].bounds), report.failure));
            rows[r].push_back({report, frame});
        }
    for (std::size_t r = 0; r < racers.size(); ++r) {
        Racer& racer = racers[r];
        if (audited && can_miss(racer.bounds)) rows[r].back().audit = racer.audit.check(racer.world);
        racer.table.add(rows[r]);
    }
}

/// The largest distance of a node from its place in the first run, metres.
double farthest(const Racer& racer, const Racer& first) {
    double result = 0;
    for (int b = 0; b < racer.world.body_count(); ++b) {
        const Nodes apart = racer.world.state(b).x - first.world.state(b).x;
        result = std::max(result, apart.rowwise().norm().maxCoeff());
    }
    return result;
}

/// A table for people.
std::string to_text(const Racers& racers) {
    std::string text =
        fmt::format("{:<15} {:>11} {:>13} {:>9} {:>9} {:>13} {:>16} {:>9}", "bounds", "search, ms",
                    "detection, ms", "step, ms", "search, %", "nodes bounded", "missed, near", "apart, %");
    for (const Racer& racer : racers) {
        const StepTotals& t = racer.table.totals();
        const auto missed = [&](long count, long of) {
            return t.audited_frames > 0 ? fmt::format("{} of {}", count, of) : std::string("-");
        };
        text += fmt::format("\n{:<15} {:11.3f} {:13.3f} {:9.2f} {:9.2f} {:13.1f} {:>16} {:9.2g}",
                            name(racer.bounds), 1e-3 * t.search_us(), 1e-3 * t.mean(&StepReport::detect_us),
                            1e-3 * t.step_us(), 100 * t.search_us() / std::max(t.step_us(), 1e-3),
                            t.mean(&StepReport::nodes_bounded), missed(t.audit.near_missed, t.audit.near),
                            100 * farthest(racer, racers.front()) / racers.front().world.smallest_diagonal());
    }
    return text;
}

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

/// A row for each run: means per step in microseconds, counts of all audited frames, metres.
nlohmann::ordered_json to_json(const Racers& racers) {
    nlohmann::ordered_json table = nlohmann::ordered_json::array();
    for (const Racer& racer : racers) {
        const StepTotals& t = racer.table.totals();
        nlohmann::ordered_json row{
            {"bounds", name(racer.bounds)}, {"steps", t.steps}, {"frames_in_contact", t.frames_in_contact}};
        for (const auto& [time, us] : t.times()) row[time] = us;
        row["step_us"] = t.step_us();
        row["nodes_bounded"] = t.mean(&StepReport::nodes_bounded);
        row["audited_frames"] = t.audited_frames;
        row["near_pairs"] = t.audit.near;
        row["near_pairs_missed"] = t.audit.near_missed;
        row["farthest"] = farthest(racer, racers.front());
        table.push_back(std::move(row));
    }
    return table;
}

/// CSV of a list of objects with the same keys.
std::string to_csv(const nlohmann::ordered_json& table) {
    std::string text;
    for (const auto& [key, value] : table.front().items()) text += (text.empty() ? "" : ",") + key;
    for (const nlohmann::ordered_json& row : table) {
        char before = '\n';
        for (const auto& [key, value] : row.items()) {
            text += std::exchange(before, ',');
            text += value.is_number_float() ? fmt::format("{:.6g}", value.get<double>())
                    : value.is_string()     ? value.get<std::string>()
                                            : value.dump();
        }
    }
    return text + '\n';
}

void run(const RaceArguments& arguments, Output& out) {
    hold_blas_to_one_thread();
    SceneSpec spec = load_scene(arguments.scene);
    if (arguments.frames) spec.time.set_frames(*arguments.frames);
    std::vector<std::filesystem::path> inputs = scene_inputs(spec);
    inputs.push_back(arguments.scene);
    check_outputs({{"csv", arguments.csv, ".csv"}}, inputs);

    out.work("loading");
    std::vector<LoadedBody> bodies = load_bodies(spec, out);
    const std::vector<BoundKind> kinds = chosen_bounds(arguments, spec, bodies);
    SceneSpec any = spec;
    for (SceneBody& body : any.bodies) body.bounds = BoundKind::automatic;
    make_trees(any, bodies);  // serve all kinds
    Racers racers;
    for (const BoundKind kind : kinds) racers.emplace_back(with_bounds(spec, kind), bodies, kind);
    finish_on_interrupt();
    out.progress("frames", 0, spec.time.frames);
    for (int frame = 1; frame <= spec.time.frames; ++frame) {
        if (interrupted())
            throw Interrupted(
                fmt::format("{}: {} of {} frames done; nothing was written, the same command starts anew",
                            arguments.scene, frame - 1, spec.time.frames));
        run_frame(racers, spec.time, frame, arguments.audit > 0 && frame % arguments.audit == 0);
        out.progress("frames", frame, spec.time.frames);
    }
    out.text(fmt::format("{}: {}, {}; means per step; apart: from the first run, % of the smallest body\n{}",
                         arguments.scene, counted(spec.time.frames, "frame"),
                         counted(racers.front().table.totals().steps, "step"), to_text(racers)));
    const nlohmann::ordered_json table = to_json(racers);
    write_text(arguments.csv, to_csv(table));
    out.result({{"frames", spec.time.frames},
                {"smallest_body", racers.front().world.smallest_diagonal()},
                {"bounds", table}});
}

}  // namespace

void add_race(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<RaceArguments>(
        app, out, "race",
        "Runs a scene once with each kind of bounds, in turns, and tables what each costs and misses", run);
    command.add_option("SCENE", arguments.scene, "Scene file, JSON")->required();
    command
        .add_option("--bounds", arguments.bounds,
                    "Bounds to run with, separated by commas; default: all that every body can have")
        ->delimiter(',')
        ->check(bounds_name());
    command.add_option("--frames", arguments.frames, "Number of frames, instead of the scene's")
        ->check(whole_number(1, 10'000'000));
    command
        .add_option("--audit", arguments.audit,
                    "Every N-th frame, count the face pairs that bounds miss, of bounds that can; 0: never")
        ->check(not_negative_whole());
    command.add_option("--csv", arguments.csv, "File for the table (CSV)");
}

}  // namespace nbd
