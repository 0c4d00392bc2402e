#include <fmt/core.h>
#include <tbb/global_control.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <set>

#include "apps/bench/local_ablation.hpp"
#include "apps/bench/simulate_bench.hpp"
#include "apps/commands/bench_commands.hpp"
#include "apps/commands/commands.hpp"
#include "apps/load.hpp"
#include "apps/mesh_file.hpp"
#include "apps/option_checks.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "sim/blas.hpp"

namespace nbd {
namespace {

struct BenchSimulateArguments {
    std::vector<std::string> bodies;
    std::string csv;
    std::vector<int> nodes{2500, 5000, 10000};
    int steps = 40, threads = 0;
    double tolerance = 1e-6;
};

/// The bodies of one argument: a body file as it is, a surface meshed to each size.
std::vector<Body> bodies_of(const std::string& path, const std::vector<int>& nodes, const Output& out) {
    if (std::filesystem::path(path).extension() == ".h5") return {load_body(path)};
    std::vector<Body> bodies;
    for (const int count : nodes) {
        MeshFileConfig config;
        config.tets.nodes = count;
        bodies.push_back(mesh_file(path, config, out));
    }
    return bodies;
}

void tell(const SimulateTiming& r, const Output& out) {
    if (!r.failure.empty()) {
        out.text(fmt::format("{:12} {:7} {:6} failed: {}", r.body, r.nodes, r.scene, r.failure));
        return;
    }
    out.text(
        fmt::format("{:12} {:7} {:6} {:8.1f} = {:6.1f} + {:6.1f} + {:5.1f}   {:8.1f} {:6.1f}x   {:5.0f} "
                    "{:6.0f}   {:6.1f} {:7.1f} {:5.1f}x",
                    r.body, r.nodes, r.scene, r.step, r.assemble, r.solve, r.step - r.assemble - r.solve,
                    r.direct_step, r.step_ratio(), r.iterations, r.patch_nodes, r.ours_assembly,
                    r.textbook_assembly, r.assembly_ratio()));
}

void run(const BenchSimulateArguments& arguments, Output& out) {
    hold_blas_to_one_thread();
    if (const BlasInfo blas = blas_info(); !blas.fast) out.warning(blas.warning);
    std::optional<tbb::global_control> limit;
    if (arguments.threads > 0)
        limit.emplace(tbb::global_control::max_allowed_parallelism,
                      static_cast<std::size_t>(arguments.threads));
    if (!arguments.csv.empty())
        check_output(arguments.csv, {arguments.bodies.begin(), arguments.bodies.end()});
    out.text(fmt::format("medians in ms a step; threads: {}; both solvers to a relative residual of {:g}",
                         arguments.threads > 0 ? std::to_string(arguments.threads) : "all",
                         arguments.tolerance));
    out.text(
        "body           nodes scene      step = assembly + solve + rest   factorising  ratio   iter.  patch  "
        " "
        "assembly textbook ratio");
    std::vector<SimulateTiming> rows;
    nlohmann::ordered_json result = nlohmann::ordered_json::array();
    for (const std::string& path : arguments.bodies)
        for (const Body& body : bodies_of(path, arguments.nodes, out))
            for (const SimulateTiming& row :
                 time_simulation(body, arguments.steps, arguments.tolerance, out)) {
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
                                  {"relative_difference", row.difference}});
            }
    for (const char* scene : {"fly", "twist", "drop"})
        if (const double p = growth(rows, scene); std::isfinite(p))
            out.text(fmt::format("{}: a step costs as nodes^{:.2f}", scene, p));
    if (!arguments.csv.empty()) write_simulate_table(arguments.csv, rows);
    out.result(result);
}

struct BenchLocalArguments {
    std::string body, recording, csv;
    LocalAblationConfig config;
};

void run(const BenchLocalArguments& arguments, Output& out) {
    if (!arguments.csv.empty()) check_output(arguments.csv, {arguments.body, arguments.recording});
    const std::vector<LocalAblationRow> rows = ablate_local_bounds(
        surface_body(load_body(arguments.body)), RecordingReader(arguments.recording), arguments.config,
        [&](int done, int total) { out.progress("choices", done, total); });
    out.text(
        "rule    samples fit              depth  samples  radius error  inflation  nodes that miss, bare  "
        "box growth  misses      ns");
    nlohmann::ordered_json result = nlohmann::ordered_json::array();
    for (const LocalAblationRow& r : rows) {
        out.text(fmt::format(
            "{:7} {:>7} {:16} {:5} {:8.1f} {:13.3f} {:10.3f} {:16.4f} {:5.1f} {:11.2f} {:7.3f} {:7.0f}",
            r.rule, r.samples, r.fit, r.depth, r.mean_samples, 100 * r.radius_error, 100 * r.inflation,
            100 * r.nodes_missing, 100 * r.missing_bare, 100 * r.box_growth, 100 * r.box_missing,
            r.nanoseconds));
        result.push_back({{"rule", r.rule},
                          {"samples", r.samples},
                          {"fit", r.fit},
                          {"depth", r.depth},
                          {"mean_samples", r.mean_samples},
                          {"radius_error", r.radius_error},
                          {"inflation", r.inflation},
                          {"nodes_missing", r.nodes_missing},
                          {"nodes_missing_bare", r.missing_bare},
                          {"box_growth", r.box_growth},
                          {"box_missing", r.box_missing},
                          {"nanoseconds", r.nanoseconds}});
    }
    if (!arguments.csv.empty()) {
        h5::AtomicFile file(arguments.csv);
        file.out() << to_csv(rows);
        file.commit();
    }
    out.result(result);
}

void add_bench_local(CLI::App& bench, Output& out) {
    auto arguments = std::make_shared<BenchLocalArguments>();
    LocalAblationConfig& config = arguments->config;
    CLI::App* command = bench.add_subcommand(
        "local", "Choices of local bounds, each trained, calibrated and tested on trajectories of its own");
    command->add_option("BODY", arguments->body, "Body file")->required();
    command->add_option("DATA", arguments->recording, "Recording of the body")->required();
    command->add_option("--depth", config.depth, "Levels of the tree below the root")
        ->capture_default_str()
        ->check(CLI::Range(0, 16));
    command
        ->add_option("--samples", config.samples,
                     "Samples of a node, 0 or multiples of 16; 0: as few as are accurate")
        ->delimiter(',')
        ->capture_default_str()
        ->check(sample_count());
    command->add_option("--max-frames", config.max_frames, "Of each of the three sets, evenly spread; 0: all")
        ->capture_default_str()
        ->check(not_negative());
    command
        ->add_option("--miss-rate", config.miss_rate, "Of a node in a pose, that margins are calibrated for")
        ->capture_default_str()
        ->check(between(0, 0.5));
    command->add_option("-o,--output", arguments->csv, "Table to write, CSV");
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace

void add_bench(CLI::App& app, Output& out) {
    CLI::App* bench = app.add_subcommand("bench", "Times the program against what it is to be compared with");
    bench->require_subcommand(1);
    auto arguments = std::make_shared<BenchSimulateArguments>();
    CLI::App* simulate = bench->add_subcommand(
        "simulate", "Steps and assembly, against a factorisation a step and a textbook's loop, in one run");
    simulate->add_option("BODIES", arguments->bodies, "Body files, or surfaces to mesh at several sizes")
        ->required();
    simulate->add_option("--nodes", arguments->nodes, "Sizes for surfaces, in tet nodes")
        ->delimiter(',')
        ->check(CLI::Range(8, 10'000'000))
        ->capture_default_str();
    simulate->add_option("--steps", arguments->steps, "Steps a scene; the first is not counted")
        ->check(CLI::Range(2, 1'000'000))
        ->capture_default_str();
    simulate->add_option("--tolerance", arguments->tolerance, "Relative residual of the linear solves")
        ->check(between(1e-12, 0.5))
        ->capture_default_str();
    simulate->add_option("--threads", arguments->threads, "0: all cores")
        ->check(CLI::Range(0, 1024))
        ->capture_default_str();
    simulate->add_option("-o,--output", arguments->csv, "Table to write, CSV");
    simulate->final_callback([arguments, &out] { run(*arguments, out); });
    add_bench_local(*bench, out);
    add_bench_peers(*bench, out);
    add_bench_fig5(*bench, out);
    add_bench_scaling(*bench, out);
}

}  // namespace nbd
