#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <optional>

namespace nbd {

/// Adds --memory, in MiB. memory: set when the command line is parsed.
void add_memory_option(CLI::App& command, std::optional<std::size_t>& memory);

/// Bytes of positions that may be kept: of --memory, or the default.
std::size_t frame_memory(const std::optional<std::size_t>& memory);

}  // namespace nbd
