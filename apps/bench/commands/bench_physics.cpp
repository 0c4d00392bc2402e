#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/physics/physics_run.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/drawing/chart.hpp"

namespace nbd {
namespace {

struct PhysicsArguments {
    std::vector<std::string> checks;
    bool quick = false, list = false;
    std::string csv, picture, known, write_known;
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
    if (!arguments.picture.empty()) {
        check_output(arguments.picture, {}, ".png");
        check_charts();
    }
    if (!arguments.write_known.empty()) check_output(arguments.write_known, {}, ".csv");
    std::vector<KnownFault> known;
    if (!arguments.known.empty()) known = read_known_faults(arguments.known);

    const std::vector<PhysicsResult> results = run_physics(checks, arguments.quick, out);
    out.text(physics_table(results));
    if (!arguments.csv.empty()) write_physics_cases(arguments.csv, results);
    if (!arguments.picture.empty()) draw_chart("physics", arguments.csv, arguments.picture);
    if (!arguments.write_known.empty()) write_known_faults(arguments.write_known, results);
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const PhysicsResult& result : results)
        rows.push_back({{"check", result.check.name},
                        {"error", result.worst().found.error},
                        {"allowed", result.check.allowed},
                        {"held", result.held()},
                        {"cases", result.rows.size()},
                        {"failed", result.failed()},
                        {"seconds", result.seconds()}});
    out.result({{"checks", rows}});
    if (arguments.known.empty()) return;
    const std::vector<std::string> differences = changes(results, known);
    for (const std::string& line : differences) out.warning(line);
    if (!differences.empty())
        throw std::runtime_error(fmt::format("{} of {} checks are not as {} lists them", differences.size(),
                                             results.size(), arguments.known));
}

std::vector<std::string> names() {
    std::vector<std::string> all;
    for (const PhysicsCheck& check : physics_checks()) all.push_back(check.name);
    return all;
}

}  // namespace

void add_bench_physics(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<PhysicsArguments>();
    CLI::App* command = app.add_subcommand(
        "physics", "Compares motions with what is true of them, over sizes, steps, stiffnesses and modes");
    command->add_option("CHECKS", arguments->checks, "Checks to run; default: all")->check(one_of(names()));
    command->add_flag("--list", arguments->list, "Lists the checks and runs none");
    command->add_flag("--quick", arguments->quick, "Runs a part of each range, some minutes in all");
    CLI::Option* csv = command->add_option("-o,--output", arguments->csv, "Table of all cases to write, CSV");
    command
        ->add_option("--picture", arguments->picture,
                     "Chart of that table to write, PNG: errors over the range")
        ->needs(csv);
    command->add_option("--known", arguments->known,
                        "List of checks that do not hold, CSV: fails where one became worse or holds, "
                        "and where another fails");
    command->add_option("--write-known", arguments->write_known, "Writes that list, CSV");
    command->footer(
        "One row a check: its worst case, what was found there, and whether all cases hold.\n"
        "Runs as many cases at a time as there are threads; the outcomes do not depend on it.");
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
