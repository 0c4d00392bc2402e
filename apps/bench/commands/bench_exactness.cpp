#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/exactness/exactness.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"

namespace nbd {
namespace {

struct ExactnessArguments {
    std::vector<std::string> bodies;
    std::string csv;
    ExactnessConfig config;
};

void run(const ExactnessArguments& arguments, Output& out) {
    if (!arguments.csv.empty())
        check_output(arguments.csv, {arguments.bodies.begin(), arguments.bodies.end()}, ".csv");
    Rows rows;
    for (const std::string& file : arguments.bodies) {
        const BenchBody body = load_bench_bodies({{file}}).front();
        if (!body.tree->affine)
            throw std::runtime_error(
                fmt::format("{}: its surface does not hang on its nodes with weights of 0 or more; "
                            "allowed: one that does",
                            file));
        const std::string name = std::filesystem::path(file).stem().string();
        const Rows of_body = check_exactness(name, body, arguments.config, [&](int scenes) {
            out.progress(name, scenes, arguments.config.scenes, "scenes");
        });
        out.text(to_text(of_body, {"body", "faces", "poses", "scenes", "touching", "pairs", "queries",
                                   "different", "first_difference"}));
        rows.insert(rows.end(), of_body.begin(), of_body.end());
        if (!arguments.csv.empty()) write_csv(arguments.csv, rows);  // now, since a long run may be ended
    }
    nlohmann::ordered_json all;
    for (const char* key : {"scenes", "touching", "pairs", "queries", "different"})
        all[key] = sum_of(rows, key);
    out.text(fmt::format("{} scenes, {} answers, {} different", all["scenes"].dump(), all["queries"].dump(),
                         all["different"].dump()));
    all["rows"] = rows;
    out.result(all);
    for (const auto& row : rows)
        if (row["different"] > 0)
            throw std::runtime_error(fmt::format("{} of {} answers differ from the reference, the first: {}",
                                                 all["different"].dump(), all["queries"].dump(),
                                                 row["first_difference"].get<std::string>()));
}

}  // namespace

void add_bench_exactness(CLI::App& bench, Output& out) {
    const auto [command, arguments] = add_command<ExactnessArguments>(
        bench, out, "exactness",
        "Exact bounds against a reference without trees, in wild poses, with all kernels", run);
    command.footer("Exit status 1 if any answer differs.");
    command.add_option("BODY", arguments.bodies, "Body files")->required();
    command.add_option("--scenes", arguments.config.scenes, "Scenes of each body")
        ->check(whole_number(1, 1'000'000));
    command.add_option("--seed", arguments.config.seed, "Seed of the poses")->check(seed_check());
    command.add_option("-o,--output", arguments.csv, "File for the table (CSV)");
}

}  // namespace nbd
