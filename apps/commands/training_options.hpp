#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <optional>
#include <string>

#include "training/calibrate/calibrate.hpp"

// Options that several commands of training have, and what they tell.
namespace nbd {

/// Adds --miss-rate, --confidence and --out-of-range. config: set when the command line is parsed.
void add_calibration_options(CLI::App& command, CalibrateConfig& config);

/// Adds --memory, in MiB. memory: set when the command line is parsed.
void add_memory_option(CLI::App& command, std::optional<std::size_t>& memory);

/// Bytes of positions that may be kept: of --memory, or the default.
std::size_t frame_memory(const std::optional<std::size_t>& memory);

/// One line: stated miss rate and confidence, size of the calibration set, mean margins.
std::string describe(BoundKind kind, const Calibration& calibration, const BoundLevels& levels);

}  // namespace nbd
