#pragma once

#include <filesystem>
#include <string>

#include "tests/apps/command.hpp"

namespace nbd::test {

bool has_mpirun();

/// Runs `nbdtree` under mpirun in a folder with one thread per rank. at: NBDTREE_AT of the last rank, see
/// apps/cli/test_points.hpp, whose exit status is then in the file last_rank.status; the others wait there
/// for it. options: mpirun's. Returns the status of std::system.
Ran run_mpi(const std::filesystem::path& folder, int ranks, const std::string& line,
            const std::string& at = "", const std::string& options = "");

}  // namespace nbd::test
