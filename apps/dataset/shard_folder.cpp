#include "apps/dataset/shard_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "training/files/recording.hpp"
#include "training/files/recording_format.hpp"
#include "training/files/recording_hash.hpp"

namespace nbd {

ShardFolder::ShardFolder(const std::filesystem::path& view, int trajectories, int per_shard)
    : view_(view), folder_(view), trajectories_(trajectories), per_shard_(per_shard) {
    folder_.replace_extension(".shards");
}

int ShardFolder::end(int shard) const noexcept { return std::min(trajectories_, first(shard) + per_shard_); }

std::filesystem::path ShardFolder::part(int trajectory) const {
    return folder_ / fmt::format("{:06}.part.h5", trajectory);
}

std::string ShardFolder::shard_name(int shard) const {
    return fmt::format("{:06}-{:06}.h5", first(shard), end(shard) - 1);
}

std::string ShardFolder::relative(int shard) const {
    return (folder_.filename() / shard_name(shard)).string();
}

bool ShardFolder::has(int trajectory) const {
    std::error_code none_there;
    return std::filesystem::exists(shard(shard_of(trajectory)), none_there) ||
           std::filesystem::exists(part(trajectory), none_there);
}

int ShardFolder::count() const {
    int there = 0;
    for (int i = 0; i < trajectories_; ++i) there += has(i);
    return there;
}

namespace {

/// Reads what frames have besides positions, which verifies its checksums.
void read_all_extras(const RecordingReader& recording) {
    constexpr int frames_at_once = 16;
    for (int i = 0; const TrajectoryInfo& info : recording.trajectories()) {
        for (int begin = 0; begin < info.frames; begin += frames_at_once)
            recording.read_extras(i, begin, std::min(frames_at_once, info.frames - begin));
        ++i;
    }
}

}  // namespace

std::string shard_defect(const std::filesystem::path& path, const std::string& key, int first, int end) {
    try {
        const RecordingReader recording(path);
        if (recording.label(dataset_label) != key)
            return fmt::format("{}: belongs to another dataset", path.string());
        const auto& infos = recording.trajectories();
        if (std::ssize(infos) != end - first || infos.front().id != first || infos.back().id != end - 1)
            return fmt::format("{}: does not hold exactly trajectories {} to {}", path.string(), first,
                               end - 1);
        hash_recording(recording);
        read_all_extras(recording);
    } catch (const h5::ReadError&) {
        throw;
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return {};
}

bool pack_shard(const ShardFolder& folder, const std::string& key, const Eigen::Vector3d& origin, int shard,
                const std::function<void(const std::string&)>& warn) {
    const std::filesystem::path path = folder.shard(shard);
    const auto there = [&] { return std::filesystem::exists(path); };
    const int first = folder.first(shard), end = folder.end(shard);
    if (!there()) {
        for (int i = first; i < end; ++i)
            if (!std::filesystem::exists(folder.part(i))) return false;
        RecordingWriter whole(path, origin);
        whole.label(dataset_label, key);
        for (int i = first; i < end; ++i) {
            const std::string defect = shard_defect(folder.part(i), key, i, i + 1);
            if (there()) break;  // packed by another process, on a file system without locks
            if (!defect.empty()) {
                warn(fmt::format("remaking a damaged file: {}", defect));
                std::filesystem::remove(folder.part(i));
                return false;
            }
            const RecordingReader part(folder.part(i));
            copy_trajectory(part, 0, whole, part.trajectories().at(0), true);
        }
        if (!there()) whole.finish();
    }
    for (int i = first; i < end; ++i) std::filesystem::remove(folder.part(i));
    return true;
}

}  // namespace nbd
