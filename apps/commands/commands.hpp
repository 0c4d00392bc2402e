#pragma once

#include <CLI/CLI.hpp>

#include "apps/output.hpp"

namespace nbd {

// One function a command of `nbdtree`: each adds its subcommand with options and what to run.
void add_mesh(CLI::App& app, Output& out);
void add_modes(CLI::App& app, Output& out);
void add_dataset(CLI::App& app, Output& out);
void add_carry(CLI::App& app, Output& out);
void add_train(CLI::App& app, Output& out);
void add_calibrate(CLI::App& app, Output& out);
void add_evaluate(CLI::App& app, Output& out);
void add_figures(CLI::App& app, Output& out);
void add_transfer(CLI::App& app, Output& out);
void add_export(CLI::App& app, Output& out);
void add_trust(CLI::App& app, Output& out);
void add_simulate(CLI::App& app, Output& out);
void add_validate(CLI::App& app, Output& out);
void add_collide(CLI::App& app, Output& out);
void add_inspect(CLI::App& app, Output& out);
void add_bench(CLI::App& app, Output& out);

}  // namespace nbd
