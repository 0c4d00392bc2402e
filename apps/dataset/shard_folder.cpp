#include "apps/dataset/shard_folder.hpp"

#include <fmt/format.h>

#include <algorithm>

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

}  // namespace nbd
