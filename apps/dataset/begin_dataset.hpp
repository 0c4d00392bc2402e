#pragma once

#include <string>

#include "apps/dataset/shard_folder.hpp"

namespace nbd {

/// Starts a dataset, or prepares to continue it: creates its folder and writes the plan there. plan: from
/// plan_json(). Throws std::runtime_error, naming the file and what differs, rather than continue a dataset
/// with other options or replace another file.
void begin_dataset(const ShardFolder& folder, const std::string& plan);

}  // namespace nbd
