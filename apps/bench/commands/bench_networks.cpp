#include <fmt/core.h>

#include <filesystem>
#include <memory>
#include <utility>

#include "apps/bench/accuracy/network_steps.hpp"
#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/measure/machine.hpp"
#include "apps/cli/load_body.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

struct BenchNetworksArguments {
    std::vector<std::pair<std::string, std::string>> bodies;  // body, recording
    std::string csv;
    bool one_by_one = false;
    TrainConfig config;
};

void run(const BenchNetworksArguments& arguments, Output& out) {
    for (const auto& [body, recording] : arguments.bodies)
        if (!arguments.csv.empty()) check_output(arguments.csv, {body, recording}, ".csv");
    std::string text = fmt::format("# {}, training seed {}\n{},{}\n", this_machine(), arguments.config.seed,
                                   network_columns, accuracy_columns);
    out.text(this_machine());
    nlohmann::ordered_json result = nlohmann::ordered_json::array();
    for (const auto& [body_file, recording] : arguments.bodies) {
        const std::string name = std::filesystem::path(body_file).stem().string();
        const SurfaceBody body = surface_body(load_body(body_file));
        const std::vector<NetworkStep> steps =
            train_network_steps(body, RecordingReader(recording), arguments.config, arguments.one_by_one,
                                [&](int done, int total) { out.progress(name, done, total); });
        text += to_csv(name, steps);
        for (const NetworkStep& step : steps) {
            out.text(fmt::format("{}, {}: {} poses, {:.1f} s of processor time, {:.0f} bytes a node\n{}",
                                 name, step.network, step.poses, step.processor_seconds, step.node_bytes,
                                 to_text(step.accuracy)));
            for (const Accuracy& accuracy : step.accuracy) {
                nlohmann::ordered_json row = {{"body", name},
                                              {"network", step.network},
                                              {"trained_poses", step.poses},
                                              {"processor_seconds", step.processor_seconds},
                                              {"node_bytes", step.node_bytes}};
                row.update(to_json(accuracy));
                result.push_back(row);
            }
        }
    }
    if (!arguments.csv.empty()) {
        h5::AtomicFile file(arguments.csv);
        file.out() << text;
        file.commit();
    }
    out.result(result);
}

}  // namespace

void add_bench_networks(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<BenchNetworksArguments>();
    TrainConfig& config = arguments->config;
    CLI::App* command =
        app.add_subcommand("networks", "Compares nbd bounds as the paper has them with our default");
    command->add_option("--body", arguments->bodies, "Body file and recording; repeat for each body")
        ->required();
    command->add_option("--depth", config.tree.depth, "Levels of the tree below the root")
        ->capture_default_str()
        ->check(whole_number(0, 16));
    command
        ->add_option("--epochs", config.mlp.max_epochs,
                     "Maximum epochs; training ends earlier when it has converged")
        ->capture_default_str()
        ->check(whole_number(1, 1'000'000));
    command->add_flag("--one-by-one", arguments->one_by_one,
                      "Also add our deviations from the paper one after another");
    command->add_option("-o,--output", arguments->csv, "Table to write, CSV");
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
