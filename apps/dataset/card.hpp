#pragma once

#include <string>

#include "apps/dataset/shard_folder.hpp"
#include "meshing/body/body.hpp"
#include "training/files/dataset_manifest.hpp"

namespace nbd {

/// The card of a dataset, a page in Markdown: what it holds, how it was made, how many trajectories of each
/// kind failed or went wrong, its split, how to read it, its licence. The same dataset gives the same text.
/// name, body_file: of the view and of the body's file, without folders. licence: empty: not stated.
std::string dataset_card(const std::string& name, const Body& body, const std::string& body_file,
                         const std::string& licence, const DatasetManifest& manifest);

/// Writes the card of a complete dataset into its folder. Throws std::runtime_error with path and reason.
void write_card(const ShardFolder& folder, const Body& body, const std::string& body_file,
                const std::string& licence);

}  // namespace nbd
