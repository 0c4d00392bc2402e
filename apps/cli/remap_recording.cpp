#include "apps/cli/remap_recording.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <stdexcept>

#include "apps/cli/load_body.hpp"
#include "collision/base/notice.hpp"
#include "meshing/progress/progress.hpp"
#include "training/files/recording.hpp"
#include "training/files/recording_hash.hpp"

namespace nbd {

RemappedFrames remap_recording(const std::filesystem::path& path, const Body& from, const Body& to,
                               const std::filesystem::path& output, int trajectories) {
    check_same_tets(to.name, to.tets, from.name, from.tets);
    const std::string from_hash = body_hash(from), to_hash = body_hash(to);
    const RecordingReader recording(path);
    const auto& infos = recording.trajectories();
    const int all = infos.size();
    RemappedFrames result{.trajectories = trajectories > 0 ? std::min(trajectories, all) : all};

    bool has_edges = false;
    for (int i = 0; i < result.trajectories; ++i)
        has_edges = has_edges || recording.contents(i).contact_edges;
    if (has_edges)
        notice(fmt::format("{}: contact edges are left out, they are of the other surface", path.string()));
    RecordingWriter writer(output, recording.origin());
    writer.label("remapped_from_sha256", hash_recording(recording).hex);
    for (int i = 0; i < result.trajectories; ++i) {
        TrajectoryInfo info = infos[i];
        if (info.body_hash != from_hash)
            throw std::runtime_error(
                fmt::format("{}: trajectory {} was not recorded from {}", path.string(), info.id, from.name));
        info.body_hash = to_hash;
        copy_trajectory(recording, i, writer, info, false);
        result.frames += info.frames;
        tell_progress("trajectories", i + 1, result.trajectories);
    }
    if (recording.has_reactions()) {
        std::vector<RecordedReaction> rows = recording.reactions();
        std::erase_if(rows, [&](const RecordedReaction& row) {
            return std::ranges::none_of(infos.begin(), infos.begin() + result.trajectories,
                                        [&](const TrajectoryInfo& info) { return info.id == row.body; });
        });
        writer.add_reactions(rows);
    }
    writer.finish();
    return result;
}

}  // namespace nbd
