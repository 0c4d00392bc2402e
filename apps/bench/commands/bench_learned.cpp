#include <fmt/core.h>

#include <memory>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/kernels/learned_ablation.hpp"
#include "apps/cli/load_body.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

struct BenchLearnedArguments {
    std::string body, recording, csv;
    LearnedAblationConfig config;
};

void run(const BenchLearnedArguments& arguments, Output& out) {
    if (!arguments.csv.empty()) check_output(arguments.csv, {arguments.body, arguments.recording}, ".csv");
    const std::vector<LearnedAblationRow> rows = ablate_learned_bounds(
        surface_body(load_body(arguments.body)), RecordingReader(arguments.recording), arguments.config,
        [&](int done, int total) { out.progress("choices", done, total); });
    out.text(
        "rule    samples fit              depth  samples  radius error  inflation  nodes that miss, bare  "
        "box growth  misses      ns");
    nlohmann::ordered_json result = nlohmann::ordered_json::array();
    for (const LearnedAblationRow& r : rows) {
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

}  // namespace

void add_bench_learned(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<BenchLearnedArguments>();
    LearnedAblationConfig& config = arguments->config;
    CLI::App* command = app.add_subcommand(
        "learned",
        "Compares variants of learned bounds; training, calibration and test use different trajectories");
    command->add_option("BODY", arguments->body, "Body file")->required();
    command->add_option("DATA", arguments->recording, "Recording of the body")->required();
    command->add_option("--depth", config.depth, "Levels of the tree below the root")
        ->capture_default_str()
        ->check(whole_number(0, 16));
    command
        ->add_option("--samples", config.samples,
                     "Samples per node, multiples of 16; 0: as few as are accurate")
        ->delimiter(',')
        ->capture_default_str()
        ->check(sample_count());
    command
        ->add_option("--max-frames", config.max_frames,
                     "Maximum frames per set (training, calibration, test), evenly spread; 0: all")
        ->capture_default_str()
        ->check(not_negative_whole());
    command
        ->add_option("--box-miss-rate", config.learned.box_miss_rate,
                     "Share of training poses in which a node's grown box may miss")
        ->capture_default_str()
        ->check(number_check(">= 0 and < 1", [](double value) { return value >= 0 && value < 1; }));
    command
        ->add_option("--miss-rate", config.miss_rate,
                     "Share of poses in which a node may miss, for calibrated margins")
        ->capture_default_str()
        ->check(between(0, 0.5));
    command->add_option("-o,--output", arguments->csv, "Table to write, CSV");
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
