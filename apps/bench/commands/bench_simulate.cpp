#include <fmt/core.h>
#include <tbb/global_control.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/steps/simulate_bench.hpp"
#include "apps/cli/mesh_file.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "sim/factor/blas.hpp"

namespace nbd {
namespace {

struct BenchSimulateArguments {
    std::vector<std::string> bodies;
    std::string csv;
    std::vector<int> nodes{2500, 5000, 10000};
    SimulateBenchConfig config;
    bool alone = false;
    double poisson = 0;
    int threads = 0;
};

/// The bodies of one argument: the body of a body file, or a surface meshed at each size.
std::vector<Body> bodies_of(const std::string& path, const std::vector<int>& nodes, const Output& out) {
    if (std::filesystem::path(path).extension() == ".h5") return {load_body(path)};
    std::vector<Body> bodies;
    for (const int count : nodes) {
        MeshFileConfig config;
        config.tets.nodes = count;
        bodies.push_back(mesh_file(path, config, out).body);
    }
    return bodies;
}

void tell(const SimulateTiming& r, const Output& out) {
    if (!r.failure.empty()) {
        out.text(fmt::format("{:12} {:7} {:6} failed: {}", r.body, r.nodes, r.scene, r.failure));
        return;
    }
    const std::string ours =
        fmt::format("{:12} {:7} {:6} {:8.1f} = {:6.1f} + {:6.1f} + {:5.1f}   {:5.0f}", r.body, r.nodes,
                    r.scene, r.step, r.assemble, r.solve, r.step - r.assemble - r.solve, r.iterations);
    if (!r.has_reference()) {
        out.text(fmt::format("{}   {:6.0f}", ours, r.bytes_per_node));
        return;
    }
    out.text(fmt::format("{}   {:8.1f} {:6.1f}x   {:6.1f} {:7.1f} {:5.1f}x", ours, r.direct_step,
                         r.step_ratio(), r.ours_assembly, r.textbook_assembly, r.assembly_ratio()));
}

void run(const BenchSimulateArguments& arguments, Output& out) {
    hold_blas_to_one_thread();
    if (const BlasInfo blas = blas_info(); !blas.fast) out.warning(blas.warning);
    std::optional<tbb::global_control> limit;
    if (arguments.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, arguments.threads);
    if (!arguments.csv.empty())
        check_output(arguments.csv, {arguments.bodies.begin(), arguments.bodies.end()}, ".csv");
    out.text(fmt::format(
        "medians in ms per step; threads: {}; residuals of both solvers: {:g} of the impulses",
        arguments.threads > 0 ? std::to_string(arguments.threads) : "all", arguments.config.tolerance));
    out.text(fmt::format("body           nodes scene      step = assembly + solve + rest   iter.   {}",
                         arguments.alone ? "bytes a node" : "factorising ratio   assembly textbook ratio"));
    SimulateBenchConfig config = arguments.config;
    config.reference = !arguments.alone;
    std::vector<SimulateTiming> rows;
    nlohmann::ordered_json result = nlohmann::ordered_json::array();
    for (const std::string& path : arguments.bodies)
        for (Body& body : bodies_of(path, arguments.nodes, out)) {
            if (arguments.poisson > 0) {
                body.material.poisson = arguments.poisson;
                for (MaterialRegion& region : body.regions) region.material.poisson = arguments.poisson;
            }
            for (const SimulateTiming& row : time_simulation(body, config, out)) {
                tell(row, out);
                rows.push_back(row);
                result.push_back({{"body", row.body},
                                  {"nodes", row.nodes},
                                  {"scene", row.scene},
                                  {"step_ms", row.step},
                                  {"direct_step_ms", row.direct_step},
                                  {"step_ratio", row.step_ratio()},
                                  {"assembly_ratio", row.assembly_ratio()},
                                  {"iterations", row.iterations},
                                  {"fallbacks", row.fallbacks},
                                  {"relative_difference", row.difference},
                                  {"bytes_per_node", row.bytes_per_node}});
            }
        }
    for (const char* scene : {"fly", "twist", "drop"})
        if (const double p = growth(rows, scene); std::isfinite(p))
            out.text(fmt::format("{}: the cost of a step grows as nodes^{:.2f}", scene, p));
    if (!arguments.csv.empty()) write_simulate_table(arguments.csv, rows);
    out.result(result);
}

}  // namespace

void add_bench_simulate(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<BenchSimulateArguments>();
    CLI::App* simulate = app.add_subcommand(
        "simulate",
        "Times steps and assembly beside one factorisation per step and a textbook loop, in one run");
    simulate->add_option("BODIES", arguments->bodies, "Body files, or surfaces to mesh at several sizes")
        ->required();
    simulate->add_option("--nodes", arguments->nodes, "Sizes for surfaces, in tet nodes")
        ->delimiter(',')
        ->check(whole_number(8, 10'000'000))
        ->capture_default_str();
    simulate->add_option("--steps", arguments->config.steps, "Steps per scene; the first is not counted")
        ->check(whole_number(2, 1'000'000))
        ->capture_default_str();
    simulate
        ->add_option("--tolerance", arguments->config.tolerance,
                     "Residual of the linear solves, relative to a body's impulses")
        ->check(between(1e-12, 0.5))
        ->capture_default_str();
    simulate->add_option("--longer", arguments->config.longer, "Factor of the scenes' time step")
        ->check(between(0.01, 100))
        ->capture_default_str();
    simulate->add_option("--poisson", arguments->poisson, "Poisson's ratio; without it the body's own")
        ->check(between(0.01, 0.49));
    simulate->add_flag("--alone", arguments->alone,
                       "Without the factorising solver, which takes minutes a step on large bodies; "
                       "tells memory instead");
    simulate->add_option("--threads", arguments->threads, "Threads to use; 0: all cores")
        ->check(whole_number(0, 1024))
        ->capture_default_str();
    simulate->add_option("-o,--output", arguments->csv, "Table to write, CSV");
    simulate->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
