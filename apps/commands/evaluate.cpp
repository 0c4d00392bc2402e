#include "training/evaluate/evaluate.hpp"

#include <fmt/format.h>

#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/commands/commands.hpp"
#include "training/files/recording.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {
namespace {

struct EvaluateArguments {
    std::string tree, recording, csv;
    std::vector<std::string> bounds{"exact", "bd", "nbd", "learned_affine"};
    EvaluateConfig config;
};

nlohmann::ordered_json to_json(const EvaluationRow& row) {
    return {{"frames", row.frames},
            {"bound", name(row.bound)},
            {"depth", row.depth},
            {"margin", row.margin},
            {"radius_error", row.radius_error},
            {"inflation", row.inflation},
            {"centre_error", row.centre_error},
            {"vertices_outside", row.vertices_outside},
            {"nodes_missing", row.nodes_missing},
            {"poses", row.poses},
            {"nodes", row.nodes},
            {"vertices", row.vertices}};
}

/// As evaluate(); messages about what was asked of the tree name its file.
std::vector<EvaluationRow> evaluated(const std::string& path, const TreeFile& tree,
                                     const RecordingReader& recording, const EvaluateConfig& config) {
    try {
        return evaluate(tree, recording, config);
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(fmt::format("{}: {}", path, error.what()));
    }
}

void run(const EvaluateArguments& arguments, Output& out) {
    check_outputs({{"the table", arguments.csv, ".csv"}}, {arguments.tree, arguments.recording});
    EvaluateConfig config = arguments.config;
    config.bounds.clear();
    for (const std::string& bound : arguments.bounds) config.bounds.push_back(bound_kind(bound));

    const TreeFile tree = load_tree(arguments.tree);
    const RecordingReader recording(arguments.recording);
    out.work("evaluating");
    const std::vector<EvaluationRow> rows = evaluated(arguments.tree, tree, recording, config);
    write_text(arguments.csv, to_csv(rows));
    out.text(to_text(rows));
    out.text("root, middle and leaves; every depth: --csv");
    nlohmann::ordered_json table = nlohmann::ordered_json::array();
    for (const EvaluationRow& row : rows) table.push_back(to_json(row));
    out.result({{"rows", table}});
}

}  // namespace

void add_evaluate(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<EvaluateArguments>(
        app, out, "evaluate",
        "Measures how tight a tree's bounds are and how often they miss, on poses that training did not see",
        run);
    command.add_option("TREE", arguments.tree, "Tree file")->required();
    command
        .add_option("DATA", arguments.recording,
                    "Recording of the body: the training recording or another one")
        ->required();
    command.add_option("--bounds", arguments.bounds, "Bounds to evaluate, separated by commas")
        ->delimiter(',')
        ->check(bounds_name());
    command
        .add_option("--margins", arguments.config.margins,
                    "Shares added to every radius, separated by commas")
        ->delimiter(',')
        ->check(between(0, 10));
    command
        .add_option("--max-frames", arguments.config.max_frames,
                    "Maximum frames per set, evenly spread; 0: all")
        ->check(not_negative_whole());
    command.add_option("--csv", arguments.csv, "File for the table (CSV), every depth");
}

}  // namespace nbd
