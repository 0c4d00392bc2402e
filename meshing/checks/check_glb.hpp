#pragma once

#include <filesystem>

namespace nbd {

/// Throws std::runtime_error if the nodes of a .glb file, or the values of its JSON text, are nested so
/// deeply that reading them recursively may run out of stack, or if that text is longer than the file. What
/// else is wrong with the file is left to its reader.
void check_glb(const std::filesystem::path& path);

}  // namespace nbd
