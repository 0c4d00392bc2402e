#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "training/files/recording.hpp"

namespace nbd {

/// One file of a dataset and the SHA-256 of its bytes, in hex.
struct DatasetShard {
    std::string file;  // relative to the folder of the merged view
    std::string sha256;
};

/// A division of a dataset's complete trajectories, by their ids, ascending.
struct DatasetSplit {
    std::string name;
    std::vector<int> train, held_out;
    std::string rule{};  // JSON text: by which parameter of the recipes it divides them, and where
};

/// Name of the split that every dataset has, drawn at random.
inline constexpr const char* trajectory_split = "trajectories";
inline constexpr const char* parameter_split = "parameter";

/// Facts that a dataset's merged view stores beside the trajectories. The view is a recording with virtual
/// positions: they are stored in the shards, recordings of some trajectories each, in the same folder.
struct DatasetManifest {
    std::string key;   // identifies the dataset; label `dataset` of the view and of every shard
    std::string plan;  // JSON text: everything that determines the content
    std::vector<DatasetShard> shards;
    std::vector<int> train_trajectories, held_out_trajectories;  // ids: the split that training uses
    std::string variety;                                         // JSON text: how much the poses differ
    std::vector<DatasetSplit> splits{};                          // further ones, sorted by their names

    /// The split of this name. Throws std::invalid_argument, naming those there are.
    DatasetSplit split(std::string_view name) const;
};

/// Writes the view. Reads everything but the positions from the shards; trajectory ids must not repeat.
/// Throws std::runtime_error with path and reason if a shard cannot be read or belongs to another dataset, or
/// if the view cannot be written.
void write_dataset_view(const std::filesystem::path& view, const DatasetManifest& manifest);

/// True if the file is a merged view; false if it is missing, no HDF5 file, or another file of nbdtree.
/// Throws what h5::Reader does for a damaged file, one that cannot be read, and an HDF5 file of another
/// program.
bool is_dataset_view(const std::filesystem::path& path);

/// Throws std::runtime_error on a missing, truncated, damaged or foreign file.
DatasetManifest read_dataset_manifest(const std::filesystem::path& view);

}  // namespace nbd
