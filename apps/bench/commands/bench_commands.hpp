#pragma once

#include "apps/cli/command.hpp"

namespace nbd {

// One function per benchmark of `nbdtree-bench`; each adds its subcommand.
void add_bench_simulate(CLI::App& app, Output& out);
void add_bench_elements(CLI::App& app, Output& out);
void add_bench_peers(CLI::App& app, Output& out);
void add_bench_exactness(CLI::App& app, Output& out);
void add_bench_fig5(CLI::App& app, Output& out);
void add_bench_contact(CLI::App& app, Output& out);
void add_bench_impacts(CLI::App& app, Output& out);
void add_bench_physics(CLI::App& app, Output& out);
void add_bench_threads(CLI::App& app, Output& out);

}  // namespace nbd
