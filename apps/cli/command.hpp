#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "apps/cli/output.hpp"

namespace nbd {

/// A subcommand and its arguments, both of which live as long as the program's App.
template <class Arguments>
struct Command {
    CLI::App& app;
    Arguments& arguments;
};

/// Adds a subcommand with arguments of its own, which run() gets when the whole command line is parsed.
template <class Arguments>
Command<Arguments> add_command(CLI::App& app, Output& out, const std::string& name,
                               const std::string& description, void (*run)(const Arguments&, Output&)) {
    const auto arguments = std::make_shared<Arguments>();
    CLI::App* const command = app.add_subcommand(name, description);
    command->final_callback([arguments, run, &out] { run(*arguments, out); });
    return {*command, *arguments};
}

}  // namespace nbd
