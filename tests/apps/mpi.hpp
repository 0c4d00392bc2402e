#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/apps/command.hpp"

namespace nbd::test {

bool has_mpirun();

/// Runs `nbdtree` under mpirun in a folder with one thread per rank. options: mpirun's. Returns the status of
/// std::system.
Ran run_mpi(const std::filesystem::path& folder, const std::string& options,
            std::vector<std::string> arguments);

}  // namespace nbd::test
