#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
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

/// Why a recording is not a complete shard of trajectories first .. end - 1 of the dataset with this key; ""
/// if it is one. Reads the whole recording, which verifies every checksum. Throws h5::ReadError if the
/// system cannot read the file, which may be whole.
std::string shard_defect(const std::filesystem::path& path, const std::string& key, int first, int end);

/// Joins the parts of a shard into its file and removes them; does nothing if a trajectory is missing. Only
/// one process at a time may pack a shard. Removes unreadable parts and reports them to `warn`. Returns true
/// if the shard exists.
bool pack_shard(const ShardFolder& folder, const std::string& key, const Eigen::Vector3d& origin, int shard,
                const std::function<void(const std::string&)>& warn);

}  // namespace nbd
