#include "apps/commands/calibration_options.hpp"

#include <fmt/format.h>

#include "apps/cli/option_checks.hpp"

namespace nbd {

void add_calibration_options(CLI::App& command, CalibrateConfig& config) {
    const auto share = number_check("> 0 and < 1", [](double value) { return value > 0 && value < 1; });
    command
        .add_option("--miss-rate", config.miss_rate,
                    "Share of a depth's (pose, node) pairs that may miss with the calibrated margins")
        ->capture_default_str()
        ->check(share);
    command
        .add_option("--confidence", config.confidence,
                    "Share of fresh trajectories that keep the miss rate; default: 0.9, or the most that the "
                    "calibration trajectories can support")
        ->check(share);
    command
        .add_option("--out-of-range", config.out_of_range,
                    "Share of each node's training inputs to count as out of range; out of range, nodes are "
                    "bounded exactly")
        ->capture_default_str()
        ->check(number_check(">= 0 and < 1", [](double value) { return value >= 0 && value < 1; }));
}

std::string describe(BoundKind kind, const Calibration& calibration, const SphereTree& tree) {
    std::vector<double> sums(static_cast<std::size_t>(tree.depth()) + 1), counts = sums;
    for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
        const auto depth = static_cast<std::size_t>(tree.nodes[i].depth);
        sums[depth] += static_cast<double>(calibration.margins[i]);
        counts[depth] += 1;
    }
    std::string text = fmt::format(
        "{} bounds: at most {:g} % of a depth's nodes miss, pose by pose, in {:.4g} % of trajectories; from "
        "{} "
        "poses of {} trajectories; mean margins by depth{}",
        name(kind), 100 * calibration.miss_rate, 100 * calibration.confidence, calibration.poses,
        calibration.trajectories,
        calibration.limits.empty() ? "" : ", for inputs at the edge of the calibrated range");
    for (std::size_t depth = 0; depth < sums.size(); ++depth)
        text += fmt::format(" {:.2f}", 100 * sums[depth] / counts[depth]);
    return text + (kind == BoundKind::learned_boxes ? " % of a spread of the samples" : " % of the radius");
}

}  // namespace nbd
