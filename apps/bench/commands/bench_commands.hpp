#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>

#include "apps/cli/output.hpp"

namespace nbd {

// One function per benchmark of `nbdtree-bench`; each adds its subcommand.
void add_bench_simulate(CLI::App& app, Output& out);
void add_bench_laws(CLI::App& app, Output& out);
void add_bench_ring(CLI::App& app, Output& out);
void add_bench_solvers(CLI::App& app, Output& out);
void add_bench_elements(CLI::App& app, Output& out);
void add_bench_learned(CLI::App& app, Output& out);
void add_bench_kernels(CLI::App& app, Output& out);
void add_bench_peers(CLI::App& app, Output& out);
void add_bench_exactness(CLI::App& app, Output& out);
void add_bench_contact(CLI::App& app, Output& out);
void add_bench_physics(CLI::App& app, Output& out);
void add_bench_self(CLI::App& app, Output& out);
void add_bench_impacts(CLI::App& app, Output& out);
void add_bench_fig5(CLI::App& app, Output& out);
void add_bench_scaling(CLI::App& app, Output& out);
void add_bench_networks(CLI::App& app, Output& out);
void add_bench_strengths(CLI::App& app, Output& out);

/// Lines that end the --help of each benchmark.
std::map<std::string, std::string> bench_examples();

}  // namespace nbd
