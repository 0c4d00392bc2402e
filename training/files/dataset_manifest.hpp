#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "training/files/recording.hpp"

namespace nbd {

/// A file of a dataset, and the SHA-256 of its bytes in hex.
struct DatasetShard {
    std::string file;  // relative to the folder of the merged view
    std::string sha256;
};

/// What the merged view of a dataset says beside its trajectories. The view is a recording whose positions
/// are virtual: they lie in the shards, recordings of some trajectories each, that stand beside it.
struct DatasetManifest {
    std::string key;   // names the dataset: label `dataset` of the view and of all its shards
    std::string plan;  // JSON text: all that decides its content
    std::vector<DatasetShard> shards;
    std::vector<int> train_trajectories, held_out_trajectories;  // ids: the split that training uses
    std::string variety;                                         // JSON text: how much the poses differ
};

/// Writes the view. Reads of the shards all but the positions; their ids must not repeat. Throws
/// std::runtime_error with path and reason where a shard cannot be read, is of another dataset, or the view
/// cannot be written.
void write_dataset_view(const std::filesystem::path& view, const DatasetManifest& manifest);

/// Whether the file is such a view; false where it is missing or anything else.
bool is_dataset_view(const std::filesystem::path& path);

/// Throws std::runtime_error on a missing, truncated, damaged or foreign file.
DatasetManifest read_dataset_manifest(const std::filesystem::path& view);

}  // namespace nbd
