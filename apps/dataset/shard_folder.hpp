#pragma once

#include <filesystem>
#include <string>

namespace nbd {

/// Paths of a dataset's files. Next to the merged view `data.h5`, the folder `data.shards` has one recording
/// per group of trajectories, or one per trajectory while the group is incomplete.
class ShardFolder {
 public:
    /// trajectories, per_shard: > 0.
    ShardFolder(const std::filesystem::path& view, int trajectories, int per_shard);

    const std::filesystem::path& view() const noexcept { return view_; }
    const std::filesystem::path& path() const noexcept { return folder_; }
    std::filesystem::path plan() const { return folder_ / "dataset.json"; }
    std::filesystem::path card() const { return folder_ / "README.md"; }
    std::filesystem::path claims() const { return folder_ / ".claims"; }

    int trajectories() const noexcept { return trajectories_; }
    int shards() const noexcept { return (trajectories_ + per_shard_ - 1) / per_shard_; }
    int shard_of(int trajectory) const noexcept { return trajectory / per_shard_; }
    int first(int shard) const noexcept { return shard * per_shard_; }
    int end(int shard) const noexcept;  // one past its last trajectory

    std::filesystem::path part(int trajectory) const;
    std::filesystem::path shard(int shard) const { return folder_ / shard_name(shard); }
    std::string shard_name(int shard) const;
    /// Path of a shard relative to the view's folder.
    std::string relative(int shard) const;

    /// True if a trajectory exists, in a part or in its shard.
    bool has(int trajectory) const;
    int count() const;  // number of existing trajectories

 private:
    std::filesystem::path view_, folder_;
    int trajectories_, per_shard_;
};

}  // namespace nbd
