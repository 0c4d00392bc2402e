#include <fmt/core.h>
#include <tbb/global_control.h>

#include <memory>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/steps/law_bench.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "sim/factor/blas.hpp"

namespace nbd {
namespace {

struct BenchLawsArguments {
    std::string body, csv;
    LawBenchConfig config;
};

void run(const BenchLawsArguments& arguments, Output& out) {
    hold_blas_to_one_thread();
    const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    if (!arguments.csv.empty()) check_output(arguments.csv, {arguments.body}, ".csv");
    const std::vector<LawTiming> rows = time_laws(load_body(arguments.body), arguments.config, out);
    out.text(fmt::format("means in ms per step on one thread; Newton's iteration to {:g}",
                         arguments.config.newton_tolerance));
    out.text("law                 tangent scene     once iter.   newton linearisations parts");
    for (const LawTiming& r : rows)
        out.text(r.failure.empty()
                     ? fmt::format("{:19} {:7} {:5} {:8.1f} {:5.1f} {:8.1f} {:14.1f} {:5.1f}", r.law,
                                   r.tangent, r.scene, r.once, r.iterations_once, r.newton, r.linearisations,
                                   r.parts)
                     : fmt::format("{:19} {:7} {:5} failed: {}", r.law, r.tangent, r.scene, r.failure));
    if (!arguments.csv.empty()) write_table(arguments.csv, rows);
}

struct BenchRingArguments {
    std::string body, csv;
    double strain = 0.02;
};

void run(const BenchRingArguments& arguments, Output& out) {
    if (!arguments.csv.empty()) check_output(arguments.csv, {arguments.body}, ".csv");
    const std::vector<Ringing> rows = ring(load_body(arguments.body), arguments.strain, out);
    out.text("share of the energy that is left after");
    out.text("law                 integrator     steps a period  1 period  10 periods");
    for (const Ringing& r : rows)
        out.text(r.failure.empty() ? fmt::format("{:19} {:14} {:14} {:9.3f} {:11.3f}", r.law, r.integrator,
                                                 r.steps_per_period, r.energy_1, r.energy_10)
                                   : fmt::format("{:19} {:14} {:14} failed: {}", r.law, r.integrator,
                                                 r.steps_per_period, r.failure));
    if (!arguments.csv.empty()) write_table(arguments.csv, rows);
}

}  // namespace

void add_bench_laws(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<BenchLawsArguments>();
    CLI::App* laws =
        app.add_subcommand("laws", "Times steps of every law of elasticity, linearised once and by Newton");
    laws->add_option("BODY", arguments->body, "Body file")->required();
    laws->add_option("--steps", arguments->config.steps, "Steps per scene, besides the first")
        ->check(whole_number(1, 1'000'000))
        ->capture_default_str();
    laws->add_option("--tolerance", arguments->config.newton_tolerance, "Residual at which Newton stops")
        ->check(between(1e-9, 0.5))
        ->capture_default_str();
    laws->add_option("-o,--output", arguments->csv, "Table to write, CSV");
    laws->final_callback([arguments, &out] { run(*arguments, out); });
}

void add_bench_ring(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<BenchRingArguments>();
    CLI::App* ring = app.add_subcommand(
        "ring", "Lets an undamped body vibrate and tells how much energy each integrator loses");
    ring->add_option("BODY", arguments->body, "Body file")->required();
    ring->add_option("--strain", arguments->strain, "Largest strain at the start")
        ->check(between(1e-6, 0.5))
        ->capture_default_str();
    ring->add_option("-o,--output", arguments->csv, "Table to write, CSV");
    ring->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
