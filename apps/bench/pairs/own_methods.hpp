#pragma once

#include <vector>

#include "apps/bench/pairs/pair_method.hpp"

namespace nbd {

/// Bounds of the body's tree through PosedTree and PairQuery.
PairMethodEntry tree_method(BoundKind kind);

/// The bounds of a tree that are raced. Not `certified`: a recording lacks the stretch that they are made of.
std::vector<BoundKind> raced_bounds(const CollisionTree& tree);

/// Each of these by its name, and learned ones twice more: over the nodes, with positions that are computed
/// where they are read, and the broad phase alone, down to pairs of leaves.
std::vector<PairMethodEntry> tree_methods(const BenchBody& body);

/// LazyBoxes over the surface, list by list and in the order of memory.
PairMethodEntry lazy_boxes_method(int cluster_faces);
PairMethodEntry streamed_boxes_method(int cluster_faces);

/// Exact bounds that need no training: boxes refitted as a whole (the library's, of trees with small leaves);
/// LazyBoxes; these with the making of all positions from the nodes included; and LazyBoxes over the nodes
/// alone, the cage, where no weight of the embedding is negative. clusters: sizes to try, one method each.
std::vector<PairMethodEntry> box_methods(const BenchBody& body, const std::vector<int>& clusters);

/// No method: reads every vertex of both surfaces once and answers nothing. What any method that looks at
/// the whole surface pays.
PairMethodEntry reading_alone();

}  // namespace nbd
