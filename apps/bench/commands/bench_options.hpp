#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "apps/bench/pairs/race.hpp"

namespace nbd {

// Options that the benchmarks of collision queries share.

/// Body and tree files, as load_bench_bodies() takes them.
void add_bodies(CLI::App& command, std::vector<std::vector<std::string>>& bodies);

void add_race_limits(CLI::App& command, RaceConfig& race);

}  // namespace nbd
