#pragma once

#include <filesystem>

#include "training/files/tree_file.hpp"

namespace nbd {

/// Writes a tree's networks for PyTorch as plain arrays in the group `nbd`, float32 except the int32
/// representatives:
/// W1 [nodes, hidden, m], b1 [nodes, hidden], W2, b2, W3 [nodes, 4, hidden], b3 [nodes, 4]; rest, out_centre,
/// out_scale [nodes, 4]; centre_map [nodes, 3, m], the linear part of the centres, zero if there is none;
/// z_centre, z_scale [m]; representatives, w [k], X [k, 3], U [3 k, m].
/// Read by training/torch/nbd_tree.py. Atomic. Throws std::runtime_error with path and reason, also if the
/// tree has no networks.
void save_torch(const std::filesystem::path& path, const TreeFile& file);

}  // namespace nbd
