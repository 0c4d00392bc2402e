#pragma once

#include <CLI/CLI.hpp>

#include "apps/output.hpp"

namespace nbd {

// What `nbdtree bench` times, one function a benchmark: each adds its subcommand.
void add_bench_peers(CLI::App& bench, Output& out);

}  // namespace nbd
