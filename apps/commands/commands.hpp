#pragma once

#include "apps/cli/command.hpp"

namespace nbd {

// One function per command of `nbdtree`; each adds its subcommand.
void add_mesh(CLI::App& app, Output& out);
void add_modes(CLI::App& app, Output& out);
void add_dataset(CLI::App& app, Output& out);
void add_remap(CLI::App& app, Output& out);
void add_train(CLI::App& app, Output& out);
void add_calibrate(CLI::App& app, Output& out);
void add_evaluate(CLI::App& app, Output& out);
void add_transfer(CLI::App& app, Output& out);
void add_export(CLI::App& app, Output& out);
void add_coverage(CLI::App& app, Output& out);
void add_simulate(CLI::App& app, Output& out);
void add_race(CLI::App& app, Output& out);
void add_validate(CLI::App& app, Output& out);
void add_collide(CLI::App& app, Output& out);
void add_inspect(CLI::App& app, Output& out);
void add_view(CLI::App& app, Output& out);

}  // namespace nbd
