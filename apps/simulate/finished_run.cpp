#include "apps/simulate/finished_run.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "meshing/h5/types.hpp"
#include "training/files/recording.hpp"

namespace nbd {
namespace {

/// Whether every trajectory of a recording has as many frames, and what its frames are to hold.
bool has_all(const std::filesystem::path& path, int frames, const ExtrasRequest& extras) {
    const RecordingReader recording(path);
    for (int i = 0; i < static_cast<int>(recording.trajectories().size()); ++i) {
        if (recording.trajectories()[static_cast<std::size_t>(i)].frames != frames) return false;
        const FrameContents& contents = recording.contents(i);
        if (extras.contact_edges && !contents.contact_edges) return false;
        for (const FrameFieldName& field : frame_fields)
            if (extras.fields[field.field] && !contents.fields[field.field]) return false;
    }
    return true;
}

/// None where the file is no recording.
std::vector<TrajectoryInfo> trajectories_of(const std::filesystem::path& path) {
    try {
        return RecordingReader(path).trajectories();
    } catch (const h5::ReadError&) {
        throw;
    } catch (const std::runtime_error&) {
        return {};
    }
}

}  // namespace

bool is_finished(const SceneOutput& paths, const std::vector<std::filesystem::path>& inputs, int frames,
                 const ExtrasRequest& extras) {
    for (const auto& output : {paths.recording, paths.csv, paths.vtu, paths.obj, paths.picture})
        if (!output.empty() && !std::filesystem::exists(output)) return false;
    if (std::filesystem::exists(journal_path(paths))) return false;
    const auto written = std::filesystem::last_write_time(paths.recording);
    for (const std::filesystem::path& input : inputs)
        if (std::filesystem::exists(input) && std::filesystem::last_write_time(input) >= written)
            return false;
    return has_all(paths.recording, frames, extras);
}

void check_no_other_run(const SceneOutput& paths, const SceneSpec& spec) {
    if (!std::filesystem::exists(paths.recording) || std::filesystem::exists(journal_path(paths))) return;
    for (const TrajectoryInfo& body : trajectories_of(paths.recording)) {
        if (!body.failure.empty()) continue;
        const int frames = body.frames - 1;  // without the start
        if (body.recipe.str() == spec.text && frames == spec.time.frames) continue;
        throw std::runtime_error(fmt::format(
            "{}: holds a finished run of {}; without --resume it is replaced", paths.recording.string(),
            body.recipe.str() == spec.text ? fmt::format("{} frames instead of {}", frames, spec.time.frames)
                                           : "another scene"));
    }
}

}  // namespace nbd
