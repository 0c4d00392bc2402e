#pragma once

#include <CLI/CLI.hpp>

#include "apps/cli/output.hpp"

namespace nbd {

// One function a command of `nbdtree`: each adds its subcommand with options and what to run.
void add_mesh(CLI::App& app, Output& out);
void add_modes(CLI::App& app, Output& out);
void add_dataset(CLI::App& app, Output& out);
void add_remap(CLI::App& app, Output& out);
void add_train(CLI::App& app, Output& out);
void add_calibrate(CLI::App& app, Output& out);
void add_evaluate(CLI::App& app, Output& out);
void add_figures(CLI::App& app, Output& out);
void add_transfer(CLI::App& app, Output& out);
void add_export(CLI::App& app, Output& out);
void add_coverage(CLI::App& app, Output& out);
void add_simulate(CLI::App& app, Output& out);
void add_validate(CLI::App& app, Output& out);
void add_collide(CLI::App& app, Output& out);
void add_inspect(CLI::App& app, Output& out);

/// The command of release 0.1 for what is the program `nbdtree-bench` now: runs that, with a notice.
void add_bench(CLI::App& app);

}  // namespace nbd
