#pragma once

#include <vector>

#include "apps/bench/pairs/pair_method.hpp"

namespace nbd {

/// Embree's hierarchies, refitted from pose to pose and built anew in each; they find candidates, which the
/// triangle test of PairQuery decides. Empty if Embree was not found when the program was built.
std::vector<PairMethodEntry> embree_methods();

}  // namespace nbd
