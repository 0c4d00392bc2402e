#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <string>

#include "apps/cli/output.hpp"

namespace nbd {

/// Description of a command-line program.
struct Program {
    std::string name, description;
    std::function<void(CLI::App& app, Output& out)> add_commands;
    /// Names that earlier releases knew, "COMMAND" or "COMMAND --option", with what to do instead. Each is an
    /// error.
    std::map<std::string, std::string> gone{};
    std::string first_steps{};  // what the program prints if no command is named; empty: an error
    std::map<std::string, std::string> examples{};  // ends the --help of each command, one command a line
};

/// Parses the command line, including the options common to all programs (--quiet, --json, --threads,
/// --instructions, --version), and runs the named command. Returns the exit status: 0 done, 1 failed, 2 wrong
/// usage, 130 interrupted. An error is one line on stderr, also where `describe` runs out of memory.
int run_program(Program (*describe)(), int argc, char** argv);

}  // namespace nbd
