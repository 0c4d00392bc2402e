#include <fmt/core.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/commands/commands.hpp"
#include "collision/base/notice.hpp"

namespace nbd {

void add_bench(CLI::App& app) {
    CLI::App* command = app.add_subcommand("bench", "Now a program of its own: nbdtree-bench");
    command->set_help_flag("");  // --help is for the program, too
    command->prefix_command()->group("");
    command->final_callback([command] {
        notice(
            "`nbdtree bench` is now the program `nbdtree-bench`; release 0.3 will not accept the old "
            "command");
        const auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "nbdtree-bench";
        std::vector<std::string> arguments = command->remaining();
        arguments.insert(arguments.begin(), program.string());
        std::vector<char*> argv;
        for (std::string& argument : arguments) argv.push_back(argument.data());
        argv.push_back(nullptr);
        execv(program.c_str(), argv.data());
        throw std::runtime_error(
            fmt::format("{}: cannot be run: {}", program.string(), std::strerror(errno)));
    });
}

}  // namespace nbd
