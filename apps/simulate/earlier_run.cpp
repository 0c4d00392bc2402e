#include "apps/simulate/earlier_run.hpp"

#include <fmt/format.h>

#include <memory>
#include <sstream>
#include <stdexcept>

#include "meshing/h5/types.hpp"
#include "training/files/recording.hpp"

namespace nbd {
namespace {

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
    for (const auto& output : {paths.recording, paths.csv, paths.vtu, paths.obj, paths.picture})
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

std::string run_options_text(const RunOptions& options) {
    std::string text;
    for (const auto& [name, value] : options)
        text += fmt::format("{}{}={}", text.empty() ? "" : " ", name, value);
    return text;
}

std::string differing_option(const std::string& stored, const RunOptions& options) {
    for (const auto& [name, value] : options)
        if (const std::string there = stored_value(stored, name); there != value)
            return fmt::format("{} instead of {}", as_typed(name, there), as_typed(name, value));
    return {};
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
