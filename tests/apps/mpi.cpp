#include "tests/apps/mpi.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>

#include "tests/support/file_damage.hpp"

namespace nbd::test {

bool has_mpirun() { return std::system("mpirun --version >/dev/null 2>&1") == 0; }

Ran run_mpi(const std::filesystem::path& folder, int ranks, const std::string& line, const std::string& at,
            const std::string& options) {
    const std::string command = "'" NBD_COMMAND "' " + line + " --threads 1";
    std::string job =
        "cd '" + folder.string() +
        "' && OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 ASAN_OPTIONS=detect_leaks=0 "
        "mpirun --oversubscribe " +
        options + fmt::format(" -n {} ", ranks);
    if (at.empty()) {
        job += command;
    } else {
        // The others leave work for the last one, however fast they are. Open MPI 5.0.7 crashes if ranks have
        // commands of their own.
        std::ofstream(folder / "rank.sh") << fmt::format(
            "if [ \"$OMPI_COMM_WORLD_RANK\" != {} ]; then\n"
            "    NBDTREE_AT='{}|wait|last_rank.status' exec {}\n"
            "fi\n"
            "NBDTREE_AT='{}' {}\n"
            "status=$?\necho $status >last_rank.status\nexit $status\n",
            ranks - 1, at.substr(0, at.rfind('|')), command, at, command);
        std::filesystem::remove(folder / "last_rank.status");
        job += "sh rank.sh";
    }
    job += " >mpi.out 2>mpi.err";
    const int status = std::system(job.c_str());
    return {status, read_bytes(folder / "mpi.out"), read_bytes(folder / "mpi.err")};
}

}  // namespace nbd::test
