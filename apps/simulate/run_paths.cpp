#include "apps/simulate/run_paths.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <utility>

#include "apps/cli/output_paths.hpp"
#include "meshing/h5/reader.hpp"
#include "meshing/h5/types.hpp"
#include "training/files/dataset_manifest.hpp"
#include "training/files/recording_format.hpp"

namespace nbd {
namespace {

/// Throws std::runtime_error if there is a file that is not the recording of a run: a run replaces nothing
/// else. Whether a recording is whole does not matter.
void check_replaced(const std::filesystem::path& path) {
    if (!std::filesystem::exists(path)) return;
    const auto refuse = [&](const std::string& what) {
        throw std::runtime_error(
            fmt::format("{}: cannot be written: it {}; allowed: a recording of a scene, which is replaced, "
                        "or another name",
                        path.string(), what));
    };
    std::string format;
    bool has_key = false;
    try {
        const h5::Reader reader(path);
        format = reader.format().name;
        has_key = reader.has_attribute("/", dataset_label);
    } catch (const h5::ReadError&) {  // not the file's fault
        throw;
    } catch (const std::runtime_error&) {
        refuse("holds what nbdtree did not write, or is damaged");
    }
    if (format != recording_format.name) refuse(fmt::format("is a file of format '{}'", format));
    if (is_dataset_view(path)) refuse("is a dataset");
    if (has_key) refuse("is a part of a dataset");
}

}  // namespace

SceneOutput output_paths(const SceneOutput& typed, const SceneOutput& scene, const std::string& scene_file,
                         bool outside) {
    constexpr const char* allow = "; allowed: a path within it, or --allow-outside";
    SceneOutput paths = typed;
    if (paths.recording.empty()) {
        if (scene.recording.empty()) throw CLI::RequiredError("--output");
        paths.recording = scene.recording;
        if (!outside)
            check_within(
                ".", paths.recording,
                fmt::format("the working directory, but {} names it as output{}", scene_file, allow));
    }
    const std::filesystem::path folder = paths.recording.parent_path();
    for (const auto part : {&SceneOutput::csv, &SceneOutput::vtu, &SceneOutput::obj, &SceneOutput::picture})
        if ((paths.*part).empty() && !(scene.*part).empty()) {
            paths.*part = folder / scene.*part;
            if (!outside)
                check_within(
                    folder, paths.*part,
                    fmt::format("the recording's folder, but {} names it as output{}", scene_file, allow));
        }
    return paths;
}

std::vector<std::string> other_outputs(const SceneOutput& paths) {
    std::vector<std::string> lines;
    for (const auto& [path, content] :
         {std::pair(paths.csv, "table with one line per step"),
          std::pair(paths.vtu, "folder of frames, which scene.pvd opens"),
          std::pair(paths.obj, "folder of surfaces, one file per frame and body"),
          std::pair(paths.picture, "picture of up to six frames")})
        if (!path.empty()) lines.push_back(fmt::format("{}: {}", path.string(), content));
    return lines;
}

std::filesystem::path journal_path(const SceneOutput& paths) { return paths.recording.string() + ".journal"; }

void check_outputs(const SceneOutput& paths, const std::vector<std::filesystem::path>& inputs) {
    // Twice, since the folders of VTU and OBJ files may be one.
    check_distinct({{"recording", paths.recording},
                    {"journal", journal_path(paths)},
                    {"csv", paths.csv},
                    {"picture", paths.picture},
                    {"vtu", paths.vtu}});
    check_distinct(
        {{"recording", paths.recording}, {"csv", paths.csv}, {"picture", paths.picture}, {"obj", paths.obj}});
    for (const auto& [path, extension] :
         {std::pair(paths.recording, ".h5"), std::pair(paths.csv, ".csv"), std::pair(paths.picture, ".png")})
        if (!path.empty()) check_output(path, inputs, extension);
    check_replaced(paths.recording);
    for (const auto& folder : {paths.vtu, paths.obj})
        if (!folder.empty()) check_output_folder(folder);
}

}  // namespace nbd
