#include "apps/simulate/run_files.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "apps/cli/output_paths.hpp"
#include "meshing/h5/reader.hpp"
#include "meshing/h5/types.hpp"
#include "training/files/dataset_manifest.hpp"
#include "training/files/recording.hpp"
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

/// Value of an option in a text of run_options_text(); empty if the text lacks it.
std::string stored_value(const std::string& stored, const std::string& name) {
    std::istringstream words(stored);
    for (std::string word; words >> word;)
        if (word.starts_with(name) && word.size() > name.size() && word[name.size()] == '=')
            return word.substr(name.size() + 1);
    return {};
}

std::string as_typed(const std::string& name, const std::string& value) {
    return value.empty() ? fmt::format("no {}", name) : fmt::format("{} {}", name, value);
}

/// Whether every output is there, and newer than all inputs.
bool are_up_to_date(const SceneOutput& paths, const std::vector<std::filesystem::path>& inputs) {
    for (const auto& output :
         {paths.recording, paths.csv, paths.reactions, paths.vtu, paths.obj, paths.picture})
        if (!output.empty() && !std::filesystem::exists(output)) return false;
    const auto written = std::filesystem::last_write_time(paths.recording);
    for (const std::filesystem::path& input : inputs)
        if (std::filesystem::exists(input) && std::filesystem::last_write_time(input) >= written)
            return false;
    return true;
}

/// Whether every trajectory of a recording has as many frames, and what its frames are to hold.
bool has_all(const RecordingReader& recording, int frames, const ExtrasRequest& extras) {
    for (int i = 0; i < std::ssize(recording.trajectories()); ++i) {
        if (recording.trajectories()[i].frames != frames) return false;
        const FrameContents& contents = recording.contents(i);
        if (extras.contact_edges && !contents.contact_edges) return false;
        for (const FrameFieldName& field : frame_fields)
            if (extras.fields[field.field] && !contents.fields[field.field]) return false;
    }
    return true;
}

/// Null where the file is no recording, unless it must be one.
std::unique_ptr<RecordingReader> opened(const std::filesystem::path& path, bool must_be_one) {
    try {
        return std::make_unique<RecordingReader>(path);
    } catch (const h5::ReadError&) {
        throw;
    } catch (const std::runtime_error&) {
        if (must_be_one) throw;
        return nullptr;
    }
}

/// Names the first option whose value differs from that in `stored`, a text of run_options_text(), with both
/// values: "--audit 3 instead of no --audit". Empty if none differs.
std::string differing_option(const std::string& stored, const RunOptions& options) {
    for (const auto& [name, value] : options)
        if (const std::string there = stored_value(stored, name); there != value)
            return fmt::format("{} instead of {}", as_typed(name, there), as_typed(name, value));
    return {};
}

/// How a complete run of a body differs from the wanted one; empty if it does not.
std::string difference(const TrajectoryInfo& body, const std::string& options, const WantedRun& wanted) {
    const int frames = body.frames - 1;  // without the start
    if (body.recipe.str() != wanted.spec.text) return "of another scene";
    if (frames != wanted.spec.time.frames)
        return fmt::format("of {} frames instead of {}", frames, wanted.spec.time.frames);
    const std::string option = options.empty() ? "" : differing_option(options, wanted.options);
    return option.empty() ? "" : fmt::format("with {}", option);
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
    for (const auto part : {&SceneOutput::csv, &SceneOutput::reactions, &SceneOutput::vtu, &SceneOutput::obj,
                            &SceneOutput::picture})
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
          std::pair(paths.reactions, "table of forces, a line for each support in every step"),
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
                    {"reactions", paths.reactions},
                    {"picture", paths.picture},
                    {"vtu", paths.vtu}});
    check_distinct({{"recording", paths.recording},
                    {"csv", paths.csv},
                    {"reactions", paths.reactions},
                    {"picture", paths.picture},
                    {"obj", paths.obj}});
    for (const auto& [path, extension] :
         {std::pair(paths.recording, ".h5"), std::pair(paths.csv, ".csv"), std::pair(paths.reactions, ".csv"),
          std::pair(paths.picture, ".png")})
        if (!path.empty()) check_output(path, inputs, extension);
    check_replaced(paths.recording);
    for (const auto& folder : {paths.vtu, paths.obj})
        if (!folder.empty()) check_output_folder(folder);
}

std::string run_options_text(const RunOptions& options) {
    std::string text;
    for (const auto& [name, value] : options)
        text += fmt::format("{}{}={}", text.empty() ? "" : " ", name, value);
    return text;
}

std::string given_options(const RunOptions& options) {
    std::string names;
    for (const auto& [name, value] : options)
        if (!value.empty()) names += fmt::format("{}{}", names.empty() ? "" : ", ", name);
    return names;
}

EarlierRun find_earlier_run(const SceneOutput& paths, const WantedRun& wanted) {
    if (!std::filesystem::exists(paths.recording) || std::filesystem::exists(journal_path(paths))) return {};
    const bool up_to_date = are_up_to_date(paths, wanted.inputs);
    const auto recording = opened(paths.recording, up_to_date);
    if (!recording) return {};
    const std::string options = recording->label(run_options_label);
    for (const TrajectoryInfo& body : recording->trajectories()) {
        if (!body.failure.empty()) continue;
        if (const std::string other = difference(body, options, wanted); !other.empty())
            throw std::runtime_error(
                fmt::format("{}: holds a finished run {}; without --resume it is replaced",
                            paths.recording.string(), other));
    }
    return {.is_finished = up_to_date && has_all(*recording, wanted.spec.time.frames + 1, wanted.extras),
            .tells_options = !options.empty()};
}

}  // namespace nbd
