#pragma once

#include <vector>

#include "apps/bench/pairs/pair_method.hpp"

namespace nbd {

/// Kinds of bounds worth racing on the body's tree: those it has, and `auto` where it has learned ones to
/// choose.
std::vector<BoundKind> raced_kinds(const BenchBody& body);

/// Bounds of the body's tree through PosedTree and PairQuery.
PairMethodEntry tree_method(BoundKind kind);

/// Every bound that the body's tree has, by its name, and learned ones once more over the nodes, with
/// positions that are computed where they are read.
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
