#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/physics/physics_run.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"

namespace nbd {
namespace {

struct PhysicsArguments {
    std::vector<std::string> checks;
    bool quick = false, list = false;
    std::string csv;
};

void list(const std::vector<PhysicsCheck>& checks, Output& out) {
    for (const PhysicsCheck& check : checks)
        out.text(fmt::format("{:22} {:4} cases, {:3} quick: {}", check.name, check.cases.size(),
                             std::ranges::count_if(check.cases, &PhysicsCase::quick), check.truth));
}

void run(const PhysicsArguments& arguments, Output& out) {
    std::vector<PhysicsCheck> checks = physics_checks();
    if (!arguments.checks.empty())
        std::erase_if(checks, [&](const PhysicsCheck& check) {
            return std::ranges::find(arguments.checks, check.name) == arguments.checks.end();
        });
    if (arguments.list) return list(checks, out);
    if (!arguments.csv.empty()) check_output(arguments.csv, {}, ".csv");

    const std::vector<PhysicsResult> results = run_physics(checks, arguments.quick, out);
    out.text(physics_table(results));
    if (!arguments.csv.empty()) write_csv(arguments.csv, physics_rows(results));
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const PhysicsResult& result : results)
        rows.push_back({{"check", result.check.name},
                        {"error", result.worst().found.error},
                        {"allowed", result.check.allowed},
                        {"held", result.held()},
                        {"cases", result.rows.size()},
                        {"failed", result.failed()},
                        {"worst", describe(result.check, result.worst().at)},
                        {"seconds", result.seconds()}});
    out.result({{"checks", rows}});
}

std::vector<std::string> names() {
    std::vector<std::string> all;
    for (const PhysicsCheck& check : physics_checks()) all.push_back(check.name);
    return all;
}

}  // namespace

void add_bench_physics(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<PhysicsArguments>(
        app, out, "physics", "Compares motions with what is true of them, over sizes, steps and stiffnesses",
        run);
    command.add_option("CHECKS", arguments.checks, "Checks to run; default: all")->check(one_of(names()));
    command.add_flag("--list", arguments.list, "Lists the checks and runs none");
    command.add_flag("--quick", arguments.quick, "Runs a part of each range, some minutes in all");
    command.add_option("-o,--output", arguments.csv,
                       "Table of all cases to write, CSV, which draw_charts.py draws");
    command.footer(
        "One row a check: its worst case, what was found there, and whether all cases hold.\n"
        "Runs as many cases at a time as there are threads; the outcomes do not depend on it.");
}

}  // namespace nbd
