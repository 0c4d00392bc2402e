#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "training/calibrate/calibrate.hpp"

namespace nbd {

/// Adds --miss-rate, --confidence and --out-of-range. config: set when the command line is parsed.
void add_calibration_options(CLI::App& command, CalibrateConfig& config);

/// One line: stated miss rate and confidence, size of the calibration set, mean margins.
std::string describe(BoundKind kind, const Calibration& calibration, const BoundLevels& levels);

}  // namespace nbd
