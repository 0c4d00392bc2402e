#include <fmt/core.h>
#include <tbb/global_control.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/measure/read_bandwidth.hpp"
#include "apps/bench/solvers/preconditioner.hpp"
#include "apps/bench/solvers/solver_race.hpp"
#include "apps/cli/load_body.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "sim/factor/blas.hpp"

namespace nbd {
namespace {

struct BenchSolversArguments {
    std::vector<std::string> bodies;
    std::string csv;
    SolverRaceConfig config;
};

void tell(const SolverTiming& r, double memory, const Output& out) {
    out.text(fmt::format(
        "{:12} {:7} {:6} {:26} {:9.1f} {:9.1f} = {:9.1f} + {:9.1f} {:6} {:8.0f}  {}", r.body, r.nodes,
        r.scene, r.solver, r.once, r.total(), r.set_up, r.solve, r.iterations, r.megabytes,
        r.bandwidth > 0 ? fmt::format("{:.1f} GB/s, {:.0f} %", r.bandwidth / 1e9, 100 * r.bandwidth / memory)
                        : r.failure));
}

void run(const BenchSolversArguments& arguments, Output& out) {
    hold_blas_to_one_thread();
    const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    if (const BlasInfo blas = blas_info(); !blas.fast) out.warning(blas.warning);
    if (!arguments.csv.empty())
        check_output(arguments.csv, {arguments.bodies.begin(), arguments.bodies.end()}, ".csv");
    for (const std::string& line : missing_preconditioners()) out.text(line);
    out.text(fmt::format("medians in ms of one system on one thread, to a relative residual of {:g}",
                         arguments.config.tolerance));
    const double memory = read_bandwidth();
    out.text(fmt::format("one thread reads {:.1f} GB/s of memory in order", memory / 1e9));
    out.text(
        "body           nodes scene  solver                          once     total =    set-up +     solve  "
        "iter.       MB");
    std::vector<SolverTiming> rows;
    nlohmann::ordered_json result = nlohmann::ordered_json::array();
    for (const std::string& path : arguments.bodies)
        for (const SolverTiming& row : race_solvers(load_body(path), arguments.config, out)) {
            tell(row, memory, out);
            rows.push_back(row);
            result.push_back({{"body", row.body},
                              {"nodes", row.nodes},
                              {"scene", row.scene},
                              {"solver", row.solver},
                              {"once_ms", row.once},
                              {"set_up_ms", row.set_up},
                              {"solve_ms", row.solve},
                              {"iterations", row.iterations},
                              {"residual", row.residual},
                              {"megabytes", row.megabytes},
                              {"bandwidth", row.bandwidth},
                              {"failure", row.failure}});
        }
    if (!arguments.csv.empty()) write_table(arguments.csv, rows);
    out.result(result);
}

}  // namespace

void add_bench_solvers(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<BenchSolversArguments>();
    CLI::App* solvers = app.add_subcommand(
        "solvers",
        "Times the linear system of a step with our solver, also deflated, a factorisation and algebraic "
        "multigrid");
    solvers->add_option("BODIES", arguments->bodies, "Body files")->required();
    solvers->add_option("--steps", arguments->config.steps, "Steps of the scene before its system is taken")
        ->check(whole_number(1, 1'000'000))
        ->capture_default_str();
    solvers->add_option("--repeats", arguments->config.repeats, "Times are medians over so many")
        ->check(whole_number(1, 1'000'000))
        ->capture_default_str();
    solvers->add_option("--tolerance", arguments->config.tolerance, "Relative residual")
        ->check(between(1e-12, 0.5))
        ->capture_default_str();
    solvers->add_option("-o,--output", arguments->csv, "Table to write, CSV");
    solvers->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
