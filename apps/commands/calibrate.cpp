#include "training/calibrate/calibrate.hpp"

#include <fmt/core.h>

#include <optional>

#include "apps/cli/output_paths.hpp"
#include "apps/commands/commands.hpp"
#include "apps/commands/training_options.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/recording.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {
namespace {

struct CalibrateArguments {
    std::string tree, recording, output;
    CalibrateConfig config;
    std::optional<std::size_t> memory;  // MiB
};

void run(const CalibrateArguments& arguments, Output& out) {
    check_output(arguments.output, {arguments.recording}, ".h5");
    out.work("calibrating");
    TreeFile file = load_tree(arguments.tree);
    const RecordingReader recording(arguments.recording);
    FrameSource source(file.W, recording, frame_memory(arguments.memory));
    calibrate(file, source, arguments.config);
    save_tree(arguments.output, file);
    nlohmann::ordered_json bounds = nlohmann::ordered_json::array();
    for (const auto& [kind, calibration] : file.tree.calibrations) {
        out.text(describe(kind, calibration, {file.tree, kind}));
        bounds.push_back({{"bound", name(kind)},
                          {"miss_rate", calibration.miss_rate},
                          {"confidence", calibration.confidence},
                          {"trajectories", calibration.trajectories},
                          {"poses", calibration.poses},
                          {"margins", calibration.margins},
                          {"limits", calibration.limits}});
    }
    out.result({{"bounds", bounds}});
}

}  // namespace

void add_calibrate(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<CalibrateArguments>(
        app, out, "calibrate", "Calibrates a tree's bounds again, for another miss rate or on other poses",
        run);
    command.footer(
        "DATA is the training recording, of which the trajectories kept for calibration are used, or "
        "another\n"
        "recording of the body, of which all complete trajectories are used.");
    command.add_option("TREE", arguments.tree, "Tree file")->required();
    command.add_option("DATA", arguments.recording, "Recording of the body")->required();
    command.add_option("-o,--output", arguments.output, "Tree file to write; may be TREE")->required();
    add_calibration_options(command, arguments.config);
    add_memory_option(command, arguments.memory);
}

}  // namespace nbd
