#pragma once

#include "training/files/recording.hpp"

namespace nbd {

/// Checks the manifest of a dataset: key, plan, the SHA-256 of its shards, what it copies from them, and its
/// splits. Throws std::runtime_error, one line with the path of the file.
void check_dataset(const RecordingReader& view);

}  // namespace nbd
