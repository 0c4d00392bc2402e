#include "tests/apps/mpi.hpp"

#include <cstdlib>

#include "tests/support/file_damage.hpp"

namespace nbd::test {

bool has_mpirun() { return std::system("mpirun --version >/dev/null 2>&1") == 0; }

Ran run_mpi(const std::filesystem::path& folder, const std::string& options,
            std::vector<std::string> arguments) {
    std::string line =
        "cd '" + folder.string() +
        "' && OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 ASAN_OPTIONS=detect_leaks=0 "
        "mpirun --oversubscribe " +
        options + " '" NBD_COMMAND "'";
    arguments.insert(arguments.end(), {"--threads", "1"});
    for (const std::string& argument : arguments) line += " '" + argument + "'";
    line += " >mpi.out 2>mpi.err";
    const int status = std::system(line.c_str());
    return {status, read_bytes(folder / "mpi.out"), read_bytes(folder / "mpi.err")};
}

}  // namespace nbd::test
