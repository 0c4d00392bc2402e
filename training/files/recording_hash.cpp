#include "training/files/recording_hash.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <optional>

#include "collision/base/notice.hpp"
#include "collision/base/stop.hpp"
#include "meshing/h5/sha256.hpp"
#include "meshing/progress/progress.hpp"

namespace nbd {
namespace {

/// Empty without a recipe: recordings of other programs may number all they make alike.
std::optional<std::uint64_t> origin_of(const TrajectoryInfo& info) {
    if (info.recipe.str().empty()) return {};
    const std::string text = fmt::format("{} {} {}", info.seed, info.id, info.recipe.str());
    std::uint64_t hash = 0;
    for (const char c : text) hash = mixed(hash, static_cast<unsigned char>(c));
    return hash;
}

void sort_unique(std::vector<std::uint64_t>& hashes) {
    std::ranges::sort(hashes);
    hashes.erase(std::unique(hashes.begin(), hashes.end()), hashes.end());
}

/// Of the positions of one frame.
std::uint64_t frame_hash(VerticesRef x) noexcept {
    std::uint64_t hash = 0;
    for (Eigen::Index v = 0; v < x.rows(); ++v)
        for (int axis = 0; axis < 3; ++axis) hash = mixed(hash, std::bit_cast<std::uint32_t>(x(v, axis)));
    return hash;
}

}  // namespace

RecordingHash hash_recording(
    const RecordingReader& recording,
    const std::function<void(int trajectory, int begin, int count, const Vertices& nodes)>& seen) {
    constexpr int frames_at_once = 64;
    h5::Sha256 hash;
    RecordingHash result;
    Vertices x;
    double read = 0;
    const auto& infos = recording.trajectories();
    for (int i = 0; i < std::ssize(infos); ++i) {
        const TrajectoryInfo& info = infos[i];
        const int nodes = recording.nodes(i);
        const std::string head = fmt::format("{} {} {} {}\n", info.id, info.frames, nodes, info.failure);
        hash.add(std::as_bytes(std::span(head)));
        std::vector<std::uint64_t>& frames = result.frames.emplace_back();
        for (int begin = 0; begin < info.frames; begin += frames_at_once) {
            stop_if_asked();
            const int count = std::min(frames_at_once, info.frames - begin);
            recording.read(i, begin, count, x);
            hash.add(std::as_bytes(std::span(x.data(), x.size())));
            for (int k = 0; k < count; ++k)
                frames.push_back(frame_hash(x.middleRows(Eigen::Index{k} * nodes, nodes)));
            if (seen) seen(i, begin, count, x);
            tell_progress("frames", read += count, static_cast<double>(recording.frames()));
        }
    }
    result.hex = hash.hex();
    return result;
}

SeenTrajectories seen_trajectories(const RecordingReader& recording, const RecordingHash& hashes,
                                   std::span<const int> ids) {
    SeenTrajectories seen;
    for (std::size_t i = 0; i < recording.trajectories().size(); ++i) {
        const TrajectoryInfo& info = recording.trajectories()[i];
        if (std::ranges::find(ids, info.id) == ids.end()) continue;
        seen.frames.insert(seen.frames.end(), hashes.frames[i].begin(), hashes.frames[i].end());
        if (const auto origin = origin_of(info)) seen.origins.push_back(*origin);
    }
    sort_unique(seen.frames);
    sort_unique(seen.origins);
    return seen;
}

std::vector<int> known_trajectories(const RecordingReader& recording, const RecordingHash& hashes,
                                    std::span<const SeenTrajectories* const> seen) {
    std::vector<int> known;
    for (std::size_t i = 0; i < recording.trajectories().size(); ++i) {
        const TrajectoryInfo& info = recording.trajectories()[i];
        const std::vector<std::uint64_t>& frames = hashes.frames[i];
        const auto origin = origin_of(info);
        const bool is_known = std::ranges::any_of(seen, [&](const SeenTrajectories* s) {
            const auto count = std::ranges::count_if(
                frames, [&](std::uint64_t hash) { return std::ranges::binary_search(s->frames, hash); });
            return 2 * count > std::ssize(frames) ||
                   (origin && std::ranges::binary_search(s->origins, *origin));
        });
        if (is_known) known.push_back(info.id);
    }
    return known;
}

void tell_left_out(const RecordingReader& recording, std::span<const int> ids, const char* use) {
    if (ids.empty()) return;
    constexpr std::size_t most = 8;
    const auto shown = ids.first(std::min(most, ids.size()));
    notice(fmt::format("{}: {} of {} trajectories are left out, as the tree was {} them: {}{}",
                       recording.path().string(), ids.size(), recording.trajectories().size(), use,
                       fmt::join(shown, ", "), shown.size() < ids.size() ? ", ..." : ""));
}

void tell_unknown(const RecordingReader& recording) {
    notice(
        fmt::format("{}: the tree's file does not say which trajectories it was trained on, so whether these "
                    "are others cannot be checked; train it again, or calibrate it with its training data",
                    recording.path().string()));
}

}  // namespace nbd
