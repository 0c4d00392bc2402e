#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <string>

#include "apps/cli/output.hpp"

namespace nbd {

/// A command-line program of ours.
struct Program {
    std::string name, description;
    std::function<void(CLI::App& app, Output& out)> add_commands;
    std::map<std::string, std::string>
        old_names{};  // commands and --options of the release before, to those of today
};

/// Parses the command line, with the options that all our programs have (--quiet, --json, --threads,
/// --instructions, --version), and runs the command that it names. Returns the exit status: 0 done, 1 failed,
/// 2 wrong usage, 130 interrupted; an error is one line on stderr.
int run_program(const Program& program, int argc, char** argv);

}  // namespace nbd
