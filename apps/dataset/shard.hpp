#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "apps/dataset/shard_folder.hpp"

namespace nbd {

/// Why a recording is not trajectories first .. end - 1 of the dataset with this key, whole: "" where it is.
/// Reads all of it, so that every checksum is verified.
std::string shard_defect(const std::filesystem::path& path, const std::string& key, int first, int end);

/// Joins the parts of a complete shard into its file and removes them; does nothing where a trajectory is
/// missing. Only one process at a time may pack a shard. Returns whether the shard is there. A part that
/// cannot be read is removed, for it is worth nothing, and `warn` hears of it.
bool pack_shard(const ShardFolder& folder, const std::string& key, int shard,
                const std::function<void(const std::string&)>& warn);

/// Hex SHA-256 of a file's bytes, as sha256sum prints it. Throws std::runtime_error with path and reason.
std::string file_sha256(const std::filesystem::path& path);

}  // namespace nbd
