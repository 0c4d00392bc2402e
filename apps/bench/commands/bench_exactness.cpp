#include <fmt/format.h>

#include <memory>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/exactness/exactness.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

struct ExactnessArguments {
    std::vector<std::string> bodies;
    std::string csv;
    ExactnessConfig config;
};

struct Sum {
    long scenes = 0, touching = 0, pairs = 0, queries = 0, different = 0;
    std::string first_difference;

    void add(const ExactnessRow& row) {
        scenes += row.scenes;
        touching += row.touching;
        pairs += row.pairs;
        queries += row.queries;
        different += row.different;
        if (first_difference.empty()) first_difference = row.first_difference;
    }
};

void run(const ExactnessArguments& arguments, Output& out) {
    if (!arguments.csv.empty())
        check_output(arguments.csv, {arguments.bodies.begin(), arguments.bodies.end()}, ".csv");
    std::vector<std::vector<ExactnessRow>> rows;
    std::vector<std::string> names;
    Sum all;
    for (const std::string& file : arguments.bodies) {
        const BenchBody body = load_bench_bodies({{file}}).front();
        if (!body.tree->affine)
            throw std::runtime_error(
                fmt::format("{}: its surface does not hang on its nodes with weights of 0 or more; "
                            "allowed: one that does",
                            file));
        names.push_back(std::filesystem::path(file).stem().string());
        rows.push_back(check_exactness(body, arguments.config, [&](int scenes) {
            out.progress(names.back(), scenes, arguments.config.scenes, "scenes");
        }));
        Sum sum;
        for (const ExactnessRow& row : rows.back()) {
            sum.add(row);
            all.add(row);
        }
        out.text(fmt::format("{}: {} faces, {} scenes, {} with pairs ({} in all), {} answers, {} different",
                             names.back(), body.faces(), sum.scenes, sum.touching, sum.pairs, sum.queries,
                             sum.different));
        if (!arguments.csv.empty()) {  // after each body, since a long run may be ended
            h5::AtomicFile csv(arguments.csv);
            csv.out() << to_csv(names, rows);
            csv.commit();
        }
    }
    out.text(fmt::format("{} scenes, {} answers, {} different", all.scenes, all.queries, all.different));
    out.result({{"scenes", all.scenes},
                {"touching", all.touching},
                {"pairs", all.pairs},
                {"queries", all.queries},
                {"different", all.different}});
    if (all.different > 0)
        throw std::runtime_error(fmt::format("{} of {} answers differ from the reference, the first: {}",
                                             all.different, all.queries, all.first_difference));
}

}  // namespace

void add_bench_exactness(CLI::App& bench, Output& out) {
    auto arguments = std::make_shared<ExactnessArguments>();
    CLI::App* command = bench.add_subcommand(
        "exactness", "Exact bounds against a reference without trees, in wild poses, with all kernels");
    command->footer("Exit status 1 if any answer differs.");
    command->add_option("BODY", arguments->bodies, "Body files")->required();
    command->add_option("--scenes", arguments->config.scenes, "Scenes of each body")
        ->check(whole_number(1, 1'000'000))
        ->capture_default_str();
    command->add_option("--seed", arguments->config.seed, "Seed of the poses")
        ->check(seed_check())
        ->capture_default_str();
    command->add_option("-o,--output", arguments->csv, "File for the table (CSV)");
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
