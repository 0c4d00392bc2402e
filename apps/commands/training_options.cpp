#include "apps/commands/training_options.hpp"

#include <fmt/format.h>

#include <numeric>

#include "apps/cli/option_checks.hpp"
#include "meshing/surface/counted.hpp"
#include "training/calibrate/statistics.hpp"
#include "training/files/frame_source.hpp"
#include "training/files/split.hpp"

namespace nbd {

void add_calibration_options(CLI::App& command, CalibrateConfig& config) {
    const auto share = number_check("> 0 and < 1", [](double value) { return value > 0 && value < 1; });
    command
        .add_option("--miss-rate", config.miss_rate,
                    "Share of a depth's (pose, node) pairs that may miss with the calibrated margins")
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
        ->check(number_check(">= 0 and < 1", [](double value) { return value >= 0 && value < 1; }));
}

void add_memory_option(CLI::App& command, std::optional<std::size_t>& memory) {
    command
        .add_option("--memory", memory,
                    "MiB of positions kept in memory at most, so that the recording is read fewer times; "
                    "default: a quarter of this machine's memory")
        ->check(whole_number(0, std::int64_t{1} << 30));
}

std::size_t frame_memory(const std::optional<std::size_t>& memory) {
    return memory ? *memory << 20 : default_frame_memory();
}

std::string describe(BoundKind kind, const Calibration& calibration, const BoundLevels& levels) {
    std::string text = fmt::format(
        "{} bounds: at most {:g} % of a depth's nodes miss, pose by pose, in {:.4g} % of trajectories, on "
        "average over calibration sets and for each depth by itself; from {} of {}: with 5 % chance, this set "
        "gives less than {:.3g} %; mean margins by depth{}",
        name(kind), 100 * calibration.miss_rate, 100 * calibration.confidence,
        counted(calibration.poses, "pose"), counted_trajectories(calibration.trajectories),
        100 * share_kept_but_for(0.05, calibration.trajectories, calibration.confidence),
        calibration.limits.empty() ? "" : ", for inputs at the edge of the calibrated range");
    for (int depth = 0; depth < levels.count(); ++depth) {
        const auto begin = calibration.margins.begin() + levels.begins[depth],
                   end = calibration.margins.begin() + levels.begins[depth + 1];
        text += fmt::format(" {:.2f}", 100 * std::accumulate(begin, end, 0.) / double(end - begin));
    }
    return text +
           (kind == BoundKind::learned_affine ? " % of a spread, then of residuals" : " % of the radius");
}

}  // namespace nbd
