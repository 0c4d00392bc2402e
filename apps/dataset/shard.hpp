#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "apps/dataset/shard_folder.hpp"

namespace nbd {

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
