#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <set>
#include <tuple>

#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/commands/commands.hpp"
#include "apps/drawing/chart.hpp"
#include "apps/figures/body_figures.hpp"
#include "meshing/surface/counted.hpp"
#include "training/files/recording.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {
namespace {

struct FiguresArguments {
    std::vector<std::tuple<std::string, std::string, std::string>> bodies;  // name, tree, recording
    std::string folder;
    int max_frames = 0;
};

/// Checks the names, which become parts of file names and cells of tables.
void check_names(const FiguresArguments& arguments) {
    std::set<std::string> names;
    for (const auto& [name, tree, recording] : arguments.bodies) {
        const bool plain = !name.empty() && std::ranges::all_of(name, [](unsigned char c) {
            return std::isalnum(c) || c == '-' || c == '_';
        });
        if (!plain)
            throw CLI::ValidationError(
                fmt::format("--body: the name is '{}'; allowed: letters, digits, - and _", name));
        if (!names.insert(name).second)
            throw CLI::ValidationError(fmt::format("--body: the name '{}' is used twice", name));
    }
}

void run(const FiguresArguments& arguments, Output& out) {
    check_names(arguments);
    const std::filesystem::path folder = arguments.folder;
    check_output_folder(folder);
    check_charts();  // fail early
    for (const auto& [name, tree, recording] : arguments.bodies) {
        load_tree(tree);
        RecordingReader{recording};
    }
    std::vector<BodyRows> bodies;
    for (const auto& [name, tree, recording] : arguments.bodies) {
        out.work(
            fmt::format("figures of {}, body {} of {}", name, bodies.size() + 1, arguments.bodies.size()));
        bodies.push_back(
            make_body_figures(name, load_tree(tree), RecordingReader(recording), arguments.max_frames).rows);
    }
    out.work("drawing");
    make_folder(folder);
    write_table_and_charts(folder, bodies);
    out.text(fmt::format("{}: figures 6, 7 and 8 of {}", folder.string(),
                         counted(bodies.size(), "body", "bodies")));
    out.result({{"folder", folder.string()}, {"bodies", bodies.size()}});
}

}  // namespace

void add_figures(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<FiguresArguments>(
        app, out, "figures", "Makes the paper's figures 6, 7 and 8 of trained trees, as a table and charts",
        run);
    command
        .add_option("--body", arguments.bodies,
                    "Name, tree file and recording of a body; repeat for each body")
        ->required();
    command.add_option("-o,--output", arguments.folder, "Folder to write to")->required();
    command.add_option("--max-frames", arguments.max_frames, "Maximum frames per set, evenly spread; 0: all")
        ->capture_default_str()
        ->check(not_negative_whole());
}

}  // namespace nbd
