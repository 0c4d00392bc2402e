#pragma once

#include <string>
#include <vector>

#include "apps/bench/pairs/bench_body.hpp"

namespace nbd {

/// Loads bodies that share their tetrahedra, in the given order (coarsest surface first). files: for each
/// body, a body file and optionally a tree file trained on it. Throws std::runtime_error that names the file
/// if it cannot be read, a tree belongs to another body, or the tetrahedra differ from the first body's.
std::vector<BenchBody> load_bench_bodies(const std::vector<std::vector<std::string>>& files);

}  // namespace nbd
