#pragma once

#include <vector>

#include "apps/bench/pairs/pair_method.hpp"

namespace nbd {

/// Method with bounds of the body's tree, through PosedTree and PairQuery.
PairMethodEntry tree_method(BoundKind kind);

/// One method for each kind of bounds that the tree has.
std::vector<PairMethodEntry> tree_methods(const BenchBody& body);

/// LazyBoxes over the surface.
PairMethodEntry lazy_boxes_method(int cluster_faces);

/// Exact bounds that need no training: LazyBoxes; LazyBoxes including the computation of all positions from
/// nodes; and, if no weight of the embedding is negative, LazyBoxes over the nodes alone (the cage).
/// clusters: cluster sizes, one method each.
std::vector<PairMethodEntry> box_methods(const BenchBody& body, const std::vector<int>& clusters);

/// Reads every vertex of both surfaces once and finds no pairs: the minimum cost of any method that reads
/// whole surfaces.
PairMethodEntry reading_alone();

}  // namespace nbd
