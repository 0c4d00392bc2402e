#pragma once

#include <vector>

#include "apps/bench/pairs/pair_method.hpp"

namespace nbd {

/// Every bound that the body's tree has, by its name, through PosedTree and PairQuery.
std::vector<PairMethodEntry> tree_methods(const BenchBody& body);

/// Exact bounds that need no training: boxes refitted as a whole, of the library's box trees with small
/// leaves; LazyBoxes; and the same over the nodes where they carry the surface with weights that are none of
/// them negative. `clusters`: sizes of LazyBoxes to try, one method each.
std::vector<PairMethodEntry> box_methods(const BenchBody& body, const std::vector<int>& clusters);

/// No method: reads every vertex of both surfaces once and answers nothing. What any method that looks at
/// the whole surface pays.
PairMethodEntry reading_alone();

}  // namespace nbd
