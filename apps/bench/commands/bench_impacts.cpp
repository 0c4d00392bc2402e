#include <fmt/format.h>

#include <cstdint>
#include <stdexcept>
#include <string>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/exactness/impacts.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"

namespace nbd {
namespace {

struct ImpactsArguments {
    std::string folder, csv;
    long random = 1000000;
    int samples = 200;
    std::uint64_t seed = 1;
};

void run(const ImpactsArguments& arguments, Output& out) {
    if (!arguments.csv.empty()) check_output(arguments.csv, {}, ".csv");
    Rows rows;
    if (!arguments.folder.empty()) rows = score_impacts(read_impact_queries(arguments.folder));
    const auto all = [&](const char* key) { return sum_of(rows, key); };
    if (!rows.empty()) {
        out.text(to_text(rows, {"scene", "kind", "queries", "collisions", "missed", "false_alarms",
                                "exhausted", "ns", "iterations", "most_iterations"}));
        out.text(fmt::format("{} queries, {} collide: {} missed, {} false alarms, {} ran out of iterations",
                             all("queries"), all("collisions"), all("missed"), all("false_alarms"),
                             all("exhausted")));
    }
    const RandomImpacts random =
        check_random_impacts(arguments.random, arguments.samples, arguments.seed, [&](long done) {
            out.progress("random motion", static_cast<double>(done), static_cast<double>(arguments.random),
                         "queries");
        });
    out.text(
        fmt::format("random motion: {} queries, {} come too near in {} samples: {} missed, {} late; "
                    "{} reported, {} ran out of iterations, {:.2g} of the step before the sample",
                    random.queries, random.collisions, arguments.samples, random.missed, random.late,
                    random.reported, random.exhausted, random.early));
    if (!arguments.csv.empty() && !rows.empty()) write_csv(arguments.csv, rows);
    out.result({{"queries", all("queries")},
                {"missed", all("missed")},
                {"false_alarms", all("false_alarms")},
                {"exhausted", all("exhausted")},
                {"random_queries", random.queries},
                {"random_collisions", random.collisions},
                {"random_missed", random.missed},
                {"random_late", random.late},
                {"rows", rows}});
    if (all("missed") + random.missed + random.late > 0) throw std::runtime_error("collisions were missed");
}

}  // namespace

void add_bench_impacts(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<ImpactsArguments>(
        app, out, "impacts",
        "Continuous collision detection against exact answers and against sampling in time", run);
    command
        .add_option("FOLDER", arguments.folder,
                    "Queries with exact answers, SCENE/{edge-edge,vertex-face}/*.csv; none: random ones only")
        ->check(CLI::ExistingDirectory);
    command.add_option("--random", arguments.random, "Number of random motions")
        ->check(whole_number(0L, 1000000000L));
    command.add_option("--samples", arguments.samples, "Distances over each random motion")
        ->check(whole_number(1, 100000));
    command.add_option("--seed", arguments.seed, "Seed of the random motions")->check(seed_check());
    command.add_option("-o,--output", arguments.csv,
                       "File for the table of the queries with exact answers (CSV)");
    command.footer("Exit status 1 if a collision is missed.");
}

}  // namespace nbd
