#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string_view>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/measure/measure.hpp"
#include "apps/bench/pairs/embree_pairs.hpp"
#include "apps/bench/pairs/own_methods.hpp"
#include "apps/bench/pairs/race.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/drawing/chart.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "training/files/recording.hpp"

namespace nbd {
namespace {

struct PeersArguments {
    std::string recording, folder;
    std::vector<std::vector<std::string>> bodies;
    std::vector<std::string> contacts{"light", "heavy"}, orders{"file", "tree"}, only;
    std::vector<int> clusters{256, 1024};
    int light = 30, heavy = 90;
    TouchingScenesConfig scenes;
    RaceConfig race;
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
        for (const std::string_view method : {"bullet", "fcl", "cgal", "rebuilt boxes"})
            if (pattern.starts_with(method))
                throw std::runtime_error(
                    fmt::format("--methods: {} is gone; apps/docs/what_did_not_pay.md has its last times, "
                                "`embree` and `lazy boxes*` are the rivals that stay",
                                method));
}

std::vector<PairMethodEntry> methods_for(const PeersArguments& arguments, const BenchBody& body) {
    std::vector<PairMethodEntry> all{reading_alone()};
    for (auto& some : {tree_methods(body), box_methods(body, arguments.clusters), embree_methods()})
        all.insert(all.end(), some.begin(), some.end());
    std::vector<std::string> names;
    for (const PairMethodEntry& method : all) names.push_back(method.name);
    std::erase_if(all, [&](const PairMethodEntry& method) { return !wanted(arguments, method.name); });
    if (all.empty())
        throw std::runtime_error(
            fmt::format("--methods: '{}' matches none; allowed: {}, or a beginning of them and *",
                        arguments.only.front(), fmt::join(names, ", ")));
    return all;
}

nlohmann::ordered_json to_json(const RaceTable& table, const RaceRow& row) {
    return {{"contact", table.contact}, {"order", table.order},     {"faces", row.faces},
            {"method", row.method},     {"exact", row.exact},       {"update_us", row.update_us},
            {"query_us", row.query_us}, {"total_us", row.total_us}, {"p95_us", row.p95_us},
            {"pairs", row.pairs},       {"missed", row.missed},     {"invented", row.invented},
            {"recall", row.recall()},   {"scenes", row.scenes},     {"rounds", row.rounds},
            {"bytes", row.bytes},       {"failure", row.failure}};
}

RaceTable race_all(const PeersArguments& arguments, const std::vector<BenchBody>& bodies,
                   const std::vector<TouchingScene>& scenes, const std::string& contact,
                   const std::string& order, Output& out) {
    RaceTable table{contact, order, {}};
    for (const BenchBody& as_given : bodies) {
        const BenchBody body = order == "tree" ? in_tree_order(as_given) : as_given;
        const std::vector<PairMethodEntry> methods = methods_for(arguments, body);
        const std::string what = fmt::format("{} {} {} faces", contact, order, body.faces());
        const auto rows = race(
            body, methods, scenes, arguments.race,
            [&](const std::string& method, double share) { out.progress(what, 100 * share, 100, method); });
        table.rows.insert(table.rows.end(), rows.begin(), rows.end());
    }
    return table;
}

void run(const PeersArguments& arguments, Output& out) {
    check_methods(arguments);
    check_output_folder(arguments.folder);
    check_charts();
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

    std::vector<RaceTable> tables;
    nlohmann::ordered_json result = nlohmann::ordered_json::array();
    for (const std::string& contact : arguments.contacts) {
        TouchingScenesConfig config = arguments.scenes;
        config.pairs = contact == "light" ? arguments.light : arguments.heavy;
        const auto scenes = make_touching_scenes(bodies.front(), recording, frames, config);
        for (const std::string& order : arguments.orders) {
            tables.push_back(race_all(arguments, bodies, scenes, contact, order, out));
            out.text(to_text(tables.back()));
            for (const RaceRow& row : tables.back().rows) result.push_back(to_json(tables.back(), row));
        }
    }
    make_folder(arguments.folder);
    const std::filesystem::path folder = arguments.folder;
    h5::AtomicFile csv(folder / "peers.csv");
    csv.out() << to_csv(tables);
    csv.commit();
    draw_chart("peers", folder / "peers.csv", folder / "peers.png");
    out.result(result);
}

}  // namespace

void add_bench_peers(CLI::App& bench, Output& out) {
    auto arguments = std::make_shared<PeersArguments>();
    CLI::App* command = bench.add_subcommand(
        "peers", "Times the intersecting faces of two deforming bodies: all bounds, exact boxes, Embree");
    command->footer(
        "Two copies of a body in poses that no tree was trained on; the second is turned and moved in until\n"
        "enough faces of the first body's surface intersect. Surfaces of all bodies hang on the same nodes.");
    command->add_option("DATA", arguments->recording, "Recording of the first body")->required();
    add_bodies(*command, arguments->bodies);
    command->add_option("-o,--output", arguments->folder, "Folder to write peers.csv and peers.png to")
        ->required();
    command->add_option("--contact", arguments->contacts, "How much the bodies overlap")
        ->delimiter(',')
        ->check(one_of({"light", "heavy"}))
        ->capture_default_str();
    command
        ->add_option("--order", arguments->orders,
                     "Order of the vertices: as in the file, or renumbered by the tree")
        ->delimiter(',')
        ->check(one_of({"file", "tree"}))
        ->capture_default_str();
    command->add_option("--methods", arguments->only, "Methods to time, by name or prefix*; default: all")
        ->delimiter(',');
    command->add_option("--clusters", arguments->clusters, "Faces per cluster of lazy boxes")
        ->delimiter(',')
        ->check(whole_number(1, 4096))
        ->capture_default_str();
    command->add_option("--light", arguments->light, "Minimum intersecting face pairs in light contact")
        ->check(whole_number(1, 1'000'000))
        ->capture_default_str();
    command->add_option("--heavy", arguments->heavy, "Minimum intersecting face pairs in heavy contact")
        ->check(whole_number(1, 1'000'000))
        ->capture_default_str();
    command->add_option("--scenes", arguments->scenes.scenes, "Number of scenes")
        ->check(whole_number(1, 10'000))
        ->capture_default_str();
    add_race_limits(*command, arguments->race);
    command->add_option("--seed", arguments->scenes.seed, "Seed of the scenes")
        ->check(seed_check())
        ->capture_default_str();
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
