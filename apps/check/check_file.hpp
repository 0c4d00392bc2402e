#pragma once

#include <filesystem>
#include <string>

#include "training/files/dataset_manifest.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// Checks a body, recording, dataset, tree or flat tree as deeply as the file itself allows: everything is
/// read, and what its parts say of each other must hold. body: file of the body that it must belong to;
/// empty: not compared with a body. Returns one line that says what was checked. Throws std::runtime_error,
/// one line with the path, what is wrong and what was allowed.
std::string check_file(const std::filesystem::path& path, const std::filesystem::path& body = {});

/// Compares the shards of a dataset with its manifest, and tells its progress. Throws std::runtime_error, one
/// line with the view's path, where the SHA-256 of one differs.
void check_shards(const std::filesystem::path& view, const DatasetManifest& manifest);

/// Checks the manifest of a dataset: key, plan, the SHA-256 of its shards, what it copies from them, and its
/// splits. Throws std::runtime_error, one line with the path of the file.
void check_dataset(const RecordingReader& view);

/// Whether the file begins like a flat tree; reads only its beginning.
bool begins_as_flat_tree(const std::filesystem::path& path);

}  // namespace nbd
