#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/measure/measure.hpp"
#include "apps/bench/pairs/race.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "training/files/frame_source.hpp"

namespace nbd {
namespace {

/// Of every race.
struct RaceArguments {
    std::string recording, folder;
    std::vector<std::vector<std::string>> bodies;
    RaceConfig race;
};

/// The methods of a race for a body.
using MethodsFor = std::function<std::vector<PairMethodEntry>(const BenchBody&)>;

/// Races on each body in turn, prints the table and returns it. contact: its kind.
Rows race_all(const RaceArguments& arguments, const std::string& contact,
              const std::vector<BenchBody>& bodies, const std::vector<TouchingScene>& scenes,
              const MethodsFor& methods_for, Output& out) {
    std::vector<RaceRow> found;
    for (const BenchBody& body : bodies) {
        const std::string what = fmt::format("{} contact, {} faces", contact, body.faces());
        const auto of_body = race(
            body, methods_for(body), scenes, arguments.race,
            [&](const std::string& method, double share) { out.progress(what, 100 * share, 100, method); });
        found.insert(found.end(), of_body.begin(), of_body.end());
    }
    const Rows table = to_rows(contact, found);
    out.text(
        fmt::format("{} contact, {} scenes; both bodies, medians and the mean of the total in us, one thread",
                    contact, scenes.size()));
    out.text(to_text(table, {"faces", "method", "reads", "update_us", "query_us", "total_us", "mean_us",
                             "p95_us", "pairs", "missed", "invented", "failure"}));
    return table;
}

/// Writes FOLDER/NAME.csv.
void write_race(const std::filesystem::path& folder, const std::string& name, const Rows& rows, Output& out) {
    make_folder(folder);
    write_csv(folder / (name + ".csv"), rows);
    out.result(rows);
}

struct PeersArguments : RaceArguments {
    std::vector<std::string> contacts{"light", "heavy"}, only;
    std::vector<int> clusters{256, 1024};
    int light = 30, heavy = 90;
    TouchingScenesConfig scenes;
};

/// Compares names; a pattern that ends in * matches a prefix.
bool matches(const std::string& method, std::string_view pattern) {
    return pattern.ends_with('*') ? method.starts_with(pattern.substr(0, pattern.size() - 1))
                                  : method == pattern;
}

bool wanted(const PeersArguments& arguments, const std::string& method) {
    return arguments.only.empty() ||
           std::ranges::any_of(arguments.only, [&](const std::string& p) { return matches(method, p); });
}

/// Throws std::runtime_error for a method that is gone.
void check_methods(const PeersArguments& arguments) {
    for (const std::string& pattern : arguments.only)
        for (const std::string_view method : {"bullet", "fcl", "cgal", "rebuilt boxes", "cage boxes",
                                              "lazy boxes from nodes", "embree rebuilt", "reading alone"})
            if (pattern.starts_with(method))
                throw std::runtime_error(
                    fmt::format("--methods: {} is gone; apps/docs/what_did_not_pay.md has its last times, "
                                "`embree` and `lazy boxes*` are the rivals that stay",
                                method));
}

std::vector<PairMethodEntry> methods_for(const PeersArguments& arguments, const BenchBody& body) {
    std::vector<PairMethodEntry> all = tree_methods(body);
    for (const int faces : arguments.clusters) all.push_back(lazy_boxes_method(faces));
    for (PairMethodEntry& method : embree_methods()) all.push_back(std::move(method));
    std::vector<std::string> names;
    for (const PairMethodEntry& method : all) names.push_back(method.name);
    std::erase_if(all, [&](const PairMethodEntry& method) { return !wanted(arguments, method.name); });
    if (all.empty())
        throw std::runtime_error(
            fmt::format("--methods: '{}' matches none; allowed: {}, or a beginning of them and *",
                        arguments.only.front(), fmt::join(names, ", ")));
    return all;
}

void run(const PeersArguments& arguments, Output& out) {
    check_methods(arguments);
    check_output_folder(arguments.folder);
    const RecordingReader recording(arguments.recording);
    const std::vector<BenchBody> bodies = load_bench_bodies(arguments.bodies);
    check_recording(bodies.front().surface.hash, bodies.front().surface.W.cols(), recording);
    const std::vector<FrameId> frames = unseen_frames(bodies, recording);
    out.text(this_machine());
    if (embree_methods().empty())
        out.text("embree: not found when this program was built (Debian: libembree-dev)");
    for (const BenchBody& body : bodies)
        out.text(fmt::format("{} faces, a tree of {} nodes: {:.1f} MB", body.faces(),
                             body.tree->spheres.nodes.size(),
                             static_cast<double>(tree_bytes(*body.tree)) / 1e6));

    const auto methods = [&](const BenchBody& body) { return methods_for(arguments, body); };
    Rows rows;
    for (const std::string& contact : arguments.contacts) {
        TouchingScenesConfig config = arguments.scenes;
        config.pairs = contact == "light" ? arguments.light : arguments.heavy;
        const auto scenes = make_touching_scenes(bodies.front(), recording, frames, config);
        const Rows table = race_all(arguments, contact, bodies, scenes, methods, out);
        rows.insert(rows.end(), table.begin(), table.end());
    }
    write_race(arguments.folder, "peers", rows, out);
}

struct Figure5Arguments : RaceArguments {
    std::vector<std::string> bounds{"exact", "nbd"};
    double distance = 0.01;
    int frames = 40;
};

void run(const Figure5Arguments& arguments, Output& out) {
    check_output_folder(arguments.folder);
    const RecordingReader recording(arguments.recording);
    const std::vector<BenchBody> bodies = load_bench_bodies(arguments.bodies);
    const double radius = bodies.front().tree->spheres.rest[0].r;
    const auto scenes = recorded_scenes(bodies.front(), recording,
                                        static_cast<float>(arguments.distance * radius), arguments.frames);
    const auto methods = [&](const BenchBody& body) {
        std::vector<PairMethodEntry> of_tree;
        for (const std::string& bound : arguments.bounds)
            if (const BoundKind kind = bound_kind(bound); has_bounds(*body.tree, kind))
                of_tree.push_back(tree_method(kind));
        return of_tree;
    };
    if (std::ranges::all_of(bodies, [&](const BenchBody& body) { return methods(body).empty(); }))
        throw std::runtime_error("none of the trees has any of the requested bounds");
    out.text(this_machine());
    const Rows rows = race_all(arguments, "recorded", bodies, scenes, methods, out);
    write_race(arguments.folder, "figure5", rows, out);
}

/// Adds the options of every race. name: of the CSV.
void add_race_options(CLI::App& command, RaceArguments& arguments, const std::string& name) {
    command
        .add_option(
            "--body", arguments.bodies,
            "Body file, and optionally a tree file trained on it; repeat for each size, coarsest first")
        ->required()
        ->expected(1, 2);
    command
        .add_option("-o,--output", arguments.folder,
                    fmt::format("Folder to write {}.csv to, which draw_charts.py draws", name))
        ->required();
    command.add_option("--rounds", arguments.race.rounds, "Maximum rounds over all scenes")
        ->check(whole_number(1, 1'000'000));
    command
        .add_option("--seconds", arguments.race.max_seconds,
                    "Maximum seconds per method and case, after the first round")
        ->check(positive());
}

}  // namespace

void add_bench_peers(CLI::App& bench, Output& out) {
    const auto [command, arguments] = add_command<PeersArguments>(
        bench, out, "peers",
        "Times the intersecting faces of two deforming bodies: all bounds, lazy boxes, Embree", run);
    command.footer(
        "Two copies of a body in poses that no tree was trained on; the second is turned and moved in until\n"
        "enough faces of the first body's surface intersect. Surfaces of all bodies hang on the same nodes.");
    command.add_option("DATA", arguments.recording, "Recording of the first body")->required();
    add_race_options(command, arguments, "peers");
    command.add_option("--contact", arguments.contacts, "How much the bodies overlap")
        ->delimiter(',')
        ->check(one_of({"light", "heavy"}));
    command.add_option("--methods", arguments.only, "Methods to time, by name or prefix*; default: all")
        ->delimiter(',');
    command.add_option("--clusters", arguments.clusters, "Faces per cluster of lazy boxes")
        ->delimiter(',')
        ->check(whole_number(1, 4096));
    command.add_option("--light", arguments.light, "Minimum intersecting face pairs in light contact")
        ->check(whole_number(1, 1'000'000));
    command.add_option("--heavy", arguments.heavy, "Minimum intersecting face pairs in heavy contact")
        ->check(whole_number(1, 1'000'000));
    command.add_option("--scenes", arguments.scenes.scenes, "Number of scenes")
        ->check(whole_number(1, 10'000));
    command.add_option("--seed", arguments.scenes.seed, "Seed of the scenes")->check(seed_check());
}

void add_bench_fig5(CLI::App& bench, Output& out) {
    const auto [command, arguments] = add_command<Figure5Arguments>(
        bench, out, "fig5", "The paper's figure 5: total, update and collision time by faces", run);
    command.footer(
        "SCENE is what `nbdtree simulate` recorded of two copies of the first body; the frames in which they\n"
        "touch are asked for on each body's surface.");
    command.add_option("SCENE", arguments.recording, "Recording of a scene of two bodies")->required();
    add_race_options(command, arguments, "figure5");
    command.add_option("--bounds", arguments.bounds, "Bounds to compare")
        ->delimiter(',')
        ->check(bounds_name());
    command
        .add_option("--distance", arguments.distance,
                    "Use frames in which the surfaces come at least this close, in radii of the body")
        ->check(between(0, 1));
    command.add_option("--frames", arguments.frames, "Maximum number of these frames, evenly spread")
        ->check(whole_number(1, 1'000'000));
}

}  // namespace nbd
