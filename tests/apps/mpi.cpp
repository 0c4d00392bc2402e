#include "tests/apps/mpi.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>

#include "tests/support/file_damage.hpp"

namespace nbd::test {

bool has_mpirun() { return std::system("mpirun --version >/dev/null 2>&1") == 0; }

Ran run_mpi(const std::filesystem::path& folder, int ranks, std::vector<std::string> arguments,
            const std::string& at, const std::string& options) {
    std::string command = "'" NBD_COMMAND "'";
    arguments.insert(arguments.end(), {"--threads", "1"});
    for (const std::string& argument : arguments) command += " '" + argument + "'";
    std::ofstream(folder / "last_rank.sh") << "NBDTREE_AT='" << at << "' " << command
                                           << "\nstatus=$?\necho $status >last_rank.status\nexit $status\n";
    std::string line =
        "cd '" + folder.string() +
        "' && OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 ASAN_OPTIONS=detect_leaks=0 "
        "mpirun --oversubscribe " +
        options;
    const bool as_asked = at.empty();
    if (as_asked) {
        line += fmt::format(" -n {} {}", ranks, command);
    } else {  // the others leave work for the last one, however fast they are
        std::filesystem::remove(folder / "last_rank.status");
        line += fmt::format(" -n {} env NBDTREE_AT='{}|wait|last_rank.status' {} : -n 1 sh last_rank.sh",
                            ranks - 1, at.substr(0, at.rfind('|')), command);
    }
    line += " >mpi.out 2>mpi.err";
    const int status = std::system(line.c_str());
    return {status, read_bytes(folder / "mpi.out"), read_bytes(folder / "mpi.err")};
}

}  // namespace nbd::test
