#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "training/calibrate/calibrate.hpp"

namespace nbd {

/// --miss-rate and --confidence. config: written to when the command line is parsed.
void add_calibration_options(CLI::App& command, CalibrateConfig& config);

/// A line: what is stated, from how much, and what it costs in margins.
std::string describe(BoundKind kind, const Calibration& calibration, const SphereTree& tree);

}  // namespace nbd
