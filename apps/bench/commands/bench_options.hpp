#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "apps/bench/pairs/race.hpp"

namespace nbd {

// Options shared by the benchmarks of collision queries.

/// Adds --body: body and tree files, as in load_bench_bodies().
void add_bodies(CLI::App& command, std::vector<std::vector<std::string>>& bodies);

/// Adds --rounds and --seconds.
void add_race_limits(CLI::App& command, RaceConfig& race);

}  // namespace nbd
