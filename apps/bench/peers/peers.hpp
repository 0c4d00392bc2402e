#pragma once

#include <string>
#include <vector>

#include "apps/bench/pairs/pair_method.hpp"

namespace nbd {

/// The other collision libraries found at build time, each in its fastest configuration. They find
/// candidates, which keep_intersecting() filters.
std::vector<PairMethodEntry> peer_methods();

/// One line per library that was not found, with the missing package.
std::vector<std::string> missing_peers();

// Each is defined in its own file, if its library was found.
std::unique_ptr<PairMethod> make_fcl_pairs(const BenchBody& body);
std::unique_ptr<PairMethod> make_bullet_gimpact_pairs(const BenchBody& body);
std::unique_ptr<PairMethod> make_bullet_dbvt_pairs(const BenchBody& body);
std::unique_ptr<PairMethod> make_embree_pairs(const BenchBody& body);
std::unique_ptr<PairMethod> make_embree_rebuilt_pairs(const BenchBody& body);
std::unique_ptr<PairMethod> make_cgal_pairs(const BenchBody& body);

}  // namespace nbd
