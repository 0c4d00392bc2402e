#pragma once

#include <filesystem>

#include "training/files/dataset_manifest.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// Compares the shards of a dataset with its manifest, and tells its progress. Throws std::runtime_error, one
/// line with the view's path, where the SHA-256 of one differs.
void check_shards(const std::filesystem::path& view, const DatasetManifest& manifest);

/// Checks the manifest of a dataset: key, plan, the SHA-256 of its shards, what it copies from them, and its
/// splits. Throws std::runtime_error, one line with the path of the file.
void check_dataset(const RecordingReader& view);

}  // namespace nbd
