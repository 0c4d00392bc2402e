#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/exactness/self_exactness.hpp"
#include "apps/bench/pairs/load_bench_bodies.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

struct SelfArguments {
    std::vector<std::string> bodies;
    std::string csv;
    ExactnessConfig config;
};

void run(const SelfArguments& arguments, Output& out) {
    if (!arguments.csv.empty())
        check_output(arguments.csv, {arguments.bodies.begin(), arguments.bodies.end()}, ".csv");
    std::vector<std::vector<SelfExactnessRow>> rows;
    std::vector<std::string> names;
    long queries = 0, different = 0;
    out.text(
        "body                faces poses    scenes    pairs answers different reference ms  walk ms tests a "
        "face proof ms proved % walk ms");
    for (const std::string& file : arguments.bodies) {
        const BenchBody body = load_bench_bodies({{file}}).front();
        if (!body.tree->affine)
            throw std::runtime_error(
                fmt::format("{}: its surface does not hang on its nodes with weights of 0 or "
                            "more; allowed: one that does",
                            file));
        names.push_back(std::filesystem::path(file).stem().string());
        rows.push_back(check_self_exactness(body, arguments.config, [&](int scenes) {
            out.progress(names.back(), scenes, arguments.config.scenes, "scenes");
        }));
        for (const SelfExactnessRow& r : rows.back()) {
            out.text(fmt::format(
                "{:16} {:8} {:9}{:6} {:8} {:7} {:9} {:12.2f} {:8.2f} {:12.1f} {:8.2f} {:8.1f} {:7.2f}",
                names.back(), r.faces, name(r.pose), r.scenes, r.pairs, r.queries, r.different,
                r.reference_ms, r.walk_ms, r.tests_per_face, r.proof_ms, 100 * r.proved, r.proved_walk_ms));
            queries += r.queries;
            different += r.different;
        }
    }
    if (!arguments.csv.empty()) {
        h5::AtomicFile csv(arguments.csv);
        csv.out() << to_csv(names, rows);
        csv.commit();
    }
    out.result({{"queries", queries}, {"different", different}});
    if (different > 0)
        throw std::runtime_error(
            fmt::format("{} of {} answers differ from the reference", different, queries));
}

}  // namespace

void add_bench_self(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<SelfArguments>();
    CLI::App* command = app.add_subcommand(
        "self",
        "Queries of a body with itself, in bent and in wild poses, against a reference without trees");
    command->add_option("BODIES", arguments->bodies, "Body files")->required();
    command->add_option("--scenes", arguments->config.scenes, "Poses of each body")
        ->check(whole_number(1, 1'000'000))
        ->capture_default_str();
    command->add_option("--seed", arguments->config.seed, "Seed of the poses")
        ->check(seed_check())
        ->capture_default_str();
    command->add_option("-o,--output", arguments->csv, "Table to write, CSV");
    command->footer("Exit status 1 if an answer differs.");
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
