#pragma once

#include <string>

#include "apps/dataset/shard_folder.hpp"
#include "meshing/body/body.hpp"
#include "training/files/dataset_manifest.hpp"

namespace nbd {

/// What a dataset's card says besides its manifest.
struct CardFacts {
    std::string name;  // of the view, without its folder
    std::string body;  // of the body file, without its folder
    int nodes = 0;     // of the body
    int tets = 0, faces = 0;
    std::string licence;  // empty: not stated
};

/// The card of a dataset, a page in Markdown: what it holds, how it was made, how many trajectories of each
/// kind failed or went wrong, its split, how to read it, its licence. The same dataset gives the same text.
std::string dataset_card(const CardFacts& facts, const DatasetManifest& manifest);

/// Writes the card of a complete dataset into its folder. body: its file's name. Throws std::runtime_error
/// with path and reason.
void write_card(const ShardFolder& folder, const Body& body, const std::string& body_file,
                const std::string& licence);

}  // namespace nbd
