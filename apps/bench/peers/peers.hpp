#pragma once

#include <string>
#include <vector>

#include "apps/bench/pairs/pair_method.hpp"

namespace nbd {

/// Collision libraries of others that were found when this program was built, each set up so that it runs at
/// its best. They give candidates, which keep_intersecting() decides.
std::vector<PairMethodEntry> peer_methods();

/// A line for each library that was not found: what is missing.
std::vector<std::string> missing_peers();

// Each defined in a file of its own where its library was found.
std::unique_ptr<PairMethod> make_fcl_pairs(const BenchBody& body);
std::unique_ptr<PairMethod> make_bullet_gimpact_pairs(const BenchBody& body);
std::unique_ptr<PairMethod> make_bullet_dbvt_pairs(const BenchBody& body);
std::unique_ptr<PairMethod> make_embree_pairs(const BenchBody& body);
std::unique_ptr<PairMethod> make_cgal_pairs(const BenchBody& body);

}  // namespace nbd
