#include <fmt/core.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>

#include "apps/commands/commands.hpp"

namespace nbd {

int run_bench_program(char** argv) {
    fmt::print(
        stderr,
        "nbdtree: warning: `nbdtree bench` is now the program `nbdtree-bench`; release 0.3 will not accept "
        "the old command\n");
    std::error_code error;
    std::string program =
        std::filesystem::read_symlink("/proc/self/exe", error).replace_filename("nbdtree-bench").string();
    argv[0] = program.data();
    execv(program.c_str(), argv);
    fmt::print(stderr, "nbdtree: error: {}: cannot be run: {}\n", program, std::strerror(errno));
    return 1;
}

}  // namespace nbd
