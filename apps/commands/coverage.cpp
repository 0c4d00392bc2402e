#include "training/evaluate/coverage.hpp"

#include <fmt/core.h>

#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/commands/commands.hpp"
#include "training/evaluate/contact_scenes.hpp"
#include "training/evaluate/evaluate.hpp"
#include "training/files/recording.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {
namespace {

struct CoverageArguments {
    std::string tree, recording, csv, contacts_csv;
    std::vector<std::string> bounds;
    ContactScenesConfig contacts;
};

/// The requested bounds, or all calibrated ones. With contact scenes, the tree must have all of them.
std::vector<BoundKind> chosen_bounds(const CoverageArguments& arguments, const CollisionTree& tree) {
    std::vector<BoundKind> kinds;
    for (const std::string& name : arguments.bounds) kinds.push_back(bound_kind(name));
    try {
        if (kinds.empty()) kinds = calibrated_bounds(tree);
        if (arguments.contacts.scenes > 0) check_has_bounds(tree, kinds);
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(fmt::format("{}: {}", arguments.tree, error.what()));
    }
    return kinds;
}

nlohmann::ordered_json to_json(const CoverageRow& row) {
    return {{"bound", name(row.bound)},
            {"depth", row.depth},
            {"trajectories", row.trajectories},
            {"keeping", row.keeping},
            {"keeping_low", row.keeping_share.low},
            {"keeping_high", row.keeping_share.high},
            {"nodes_missing", row.nodes_missing},
            {"nodes_missing_low", row.nodes_missing_mean.low},
            {"nodes_missing_high", row.nodes_missing_mean.high},
            {"vertices_outside", row.vertices_outside},
            {"inflation", row.inflation},
            {"out_of_range", row.out_of_range}};
}

nlohmann::ordered_json to_json(const ContactScenesRow& row) {
    return {{"bound", name(row.bound)},
            {"scenes", row.scenes},
            {"scenes_missing", row.scenes_missing},
            {"face_pairs", row.face_pairs},
            {"missed", row.missed},
            {"missed_share_low", row.missed_share.low},
            {"missed_share_high", row.missed_share.high},
            {"out_of_range", row.out_of_range}};
}

void run(const CoverageArguments& arguments, Output& out) {
    check_outputs({{"csv", arguments.csv, ".csv"}, {"contacts csv", arguments.contacts_csv, ".csv"}},
                  {arguments.tree, arguments.recording});
    const TreeFile file = load_tree(arguments.tree);
    const RecordingReader recording(arguments.recording);
    const auto tree = refer_to(file.tree);
    const SurfaceBody body = surface_body(file);
    const std::vector<BoundKind> kinds = chosen_bounds(arguments, *tree);
    out.work("reading the recording");
    const TestFrames poses = test_frames(file, recording).back();

    // Bounds that never miss have no coverage, but contact scenes show their cost.
    std::vector<BoundKind> measured = kinds;
    if (arguments.contacts.scenes > 0)
        std::erase_if(measured, [](BoundKind kind) { return !can_miss(kind); });
    std::vector<CoverageRow> coverage;
    for (const BoundKind kind : measured) {
        out.work(fmt::format("coverage of {} bounds", name(kind)));
        const auto rows = measure_coverage(body, tree, kind, recording, poses.frames);
        coverage.insert(coverage.end(), rows.begin(), rows.end());
    }
    out.text(poses.name);
    if (!coverage.empty()) out.text(to_text(coverage));
    write_text(arguments.csv, to_csv(coverage));
    nlohmann::ordered_json coverage_table = nlohmann::ordered_json::array(), contact_table = coverage_table;
    for (const CoverageRow& row : coverage) coverage_table.push_back(to_json(row));
    if (arguments.contacts.scenes > 0) {
        out.work("misses");
        const auto rows =
            check_contact_scenes(body, tree, kinds, recording, poses.frames, arguments.contacts);
        out.text(to_text(rows));
        write_text(arguments.contacts_csv, to_csv(rows));
        for (const ContactScenesRow& row : rows) contact_table.push_back(to_json(row));
    }
    out.result({{"coverage", coverage_table}, {"contact_scenes", contact_table}});
}

}  // namespace

void add_coverage(CLI::App& app, Output& out) {
    const auto [command, arguments] =
        add_command<CoverageArguments>(app, out, "coverage",
                                       "Measures whether a tree's calibrated bounds keep their stated "
                                       "miss rate, and how many face pairs they miss",
                                       run);
    command.footer(
        "Uses the held-out trajectories of the training recording. Of another recording of the body, uses "
        "all\n"
        "complete trajectories.");
    command.add_option("TREE", arguments.tree, "Tree file")->required();
    command.add_option("DATA", arguments.recording, "Recording of the body")->required();
    command
        .add_option("--bounds", arguments.bounds,
                    "Bounds to measure, separated by commas; default: all calibrated ones")
        ->delimiter(',')
        ->check(bounds_name());
    command
        .add_option("--contacts", arguments.contacts.scenes,
                    "Number of contact scenes of two bodies in which to count missed face pairs; 0: none")
        ->check(whole_number(0, 1'000'000));
    command.add_option("--seed", arguments.contacts.seed, "Seed of the contact scenes")->check(seed_check());
    command.add_option("--csv", arguments.csv, "File for the table of nodes and vertices (CSV)");
    command.add_option("--contacts-csv", arguments.contacts_csv,
                       "File for the table of contact scenes (CSV)");
}

}  // namespace nbd
