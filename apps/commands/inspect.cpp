#include "meshing/h5/inspect.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>

#include "apps/check/check_file.hpp"
#include "apps/commands/commands.hpp"
#include "apps/dataset/variety.hpp"
#include "collision/flat/flat_file.hpp"
#include "collision/flat/flat_tree.hpp"
#include "meshing/surface/counted.hpp"

namespace nbd {
namespace {

struct InspectArguments {
    std::string file, body;
    bool check = false;
};

/// Summary of a dataset's manifest, after verifying the checksums of its files.
std::string inspect_dataset(const std::filesystem::path& path, const Output& out) {
    const DatasetManifest manifest = read_dataset_manifest(path);
    out.work("comparing with the manifest");
    check_shards(path, manifest);
    std::string text = fmt::format("{} with the SHA-256 of the manifest; {} to train on, {} held out\n",
                                   counted(manifest.shards.size(), "file"),
                                   counted_trajectories(manifest.train_trajectories.size()),
                                   manifest.held_out_trajectories.size());
    const RecordingReader recording(path);
    for (const TrajectoryInfo& info : recording.trajectories())
        if (!info.failure.empty()) text += fmt::format("trajectory {} failed: {}\n", info.id, info.failure);
    return text + to_text(variety_from_json(manifest.variety)) + '\n';
}

/// Summary of a flat tree, after loading it with all checks.
std::string inspect_flat_tree(const std::filesystem::path& path) {
    const CollisionTree tree = load_flat_tree(path);
    std::string text = fmt::format("{}: flat tree, version {}, {} bytes\n", path.string(),
                                   FlatHeader::known_version, std::filesystem::file_size(path));
    const std::vector<std::byte> file = write_flat_tree(tree);
    const FlatReader reader(file);
    for (const FlatArray& array : reader.arrays())
        text += fmt::format("{:<40} {} {} x {}\n", array.name, array.type, array.rows, array.columns);
    return text;
}

std::string inspect_container(const std::filesystem::path& path, const Output& out) {
    std::string report = h5::inspect(path);
    if (is_dataset_view(path)) report += inspect_dataset(path, out);
    return report;
}

void run(const InspectArguments& arguments, Output& out) {
    const auto& [file, body, deep] = arguments;
    if (std::filesystem::exists(file) && !std::filesystem::is_regular_file(file) &&
        !std::filesystem::is_directory(file))
        throw std::runtime_error(file + ": is a special file; allowed: a regular file");
    out.work("reading");
    const std::string report = deep                        ? check_file(file, body)
                               : begins_as_flat_tree(file) ? inspect_flat_tree(file)
                                                           : inspect_container(file, out);
    out.text(report);
    out.result({{"file", file}, {"whole", true}, {"report", report}});
}

}  // namespace

void add_inspect(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<InspectArguments>(
        app, out, "inspect", "Prints what a file of nbdtree holds and checks that it is intact", run);
    command.add_option("FILE", arguments.file, "Body, recording, dataset, tree or flat tree file")
        ->required();
    CLI::Option* check = command.add_flag(
        "--check", arguments.check,
        "Check the content too, and print one line: numbers, indices, times, ids, shards, splits, edges");
    command.add_option("--body", arguments.body, "Body file that the file must belong to")->needs(check);
}

}  // namespace nbd
