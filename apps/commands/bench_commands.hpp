#pragma once

#include <CLI/CLI.hpp>

#include "apps/output.hpp"

namespace nbd {

// What `nbdtree bench` times, one function a benchmark: each adds its subcommand.
void add_bench_peers(CLI::App& bench, Output& out);
void add_bench_fig5(CLI::App& bench, Output& out);
void add_bench_scaling(CLI::App& bench, Output& out);

}  // namespace nbd
