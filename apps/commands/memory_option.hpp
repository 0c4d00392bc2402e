#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <optional>

namespace nbd {

/// Adds --memory, in MiB. memory: set when the command line is parsed.
void add_memory_option(CLI::App& command, std::optional<std::size_t>& memory);

/// Bytes of positions that a process may keep: of --memory, or its share of the default where `processes`
/// share a machine.
std::size_t frame_memory(const std::optional<std::size_t>& memory, int processes = 1);

}  // namespace nbd
