#pragma once

#include <filesystem>

#include "training/files/dataset_manifest.hpp"

namespace nbd {

/// Compares the shards of a dataset with its manifest, and tells its progress. Throws std::runtime_error, one
/// line with the view's path, where the SHA-256 of one differs.
void check_shards(const std::filesystem::path& view, const DatasetManifest& manifest);

}  // namespace nbd
