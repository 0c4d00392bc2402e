#pragma once

#include <string>
#include <vector>

#include "apps/bench/pairs/bench_body.hpp"

namespace nbd {

/// Bodies that share their tetrahedra, coarsest surface first as given. files: for each a body file and,
/// where it has one, a tree file trained on it. Throws std::runtime_error naming the file: where it cannot be
/// read, a tree is of another body, or the tetrahedra are not those of the first body.
std::vector<BenchBody> load_bench_bodies(const std::vector<std::vector<std::string>>& files);

}  // namespace nbd
