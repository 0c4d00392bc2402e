#include "training/calibrate/random_splits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "collision/base/stop.hpp"
#include "meshing/progress/progress.hpp"
#include "training/calibrate/bound_scores.hpp"
#include "training/files/split.hpp"

namespace nbd {

std::vector<RandomSplitsRow> check_random_splits(const BoundLevels& levels, const BoundScores& shape,
                                                 const BoundScores& pool, const CalibrateConfig& config,
                                                 int splits, std::uint64_t seed) {
    std::vector<int> ids = pool.trajectories;
    std::ranges::sort(ids);
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    if (ids.size() < 2) throw std::invalid_argument("fewer than two trajectories to draw splits from");
    std::vector<RandomSplitsRow> rows(levels.count());
    for (int s = 0; s < splits; ++s) {
        tell_progress("splits", s, splits);
        stop_if_asked();
        const DatasetSplit split = draw_held_out(ids, 0.5, seed + s);
        const Calibration calibration = calibrate(levels, shape, only(pool, split.train), config);
        const BoundScores test = only(pool, split.held_out);
        for (std::size_t depth = 0; depth < rows.size(); ++depth) {
            RandomSplitsRow& row = rows[depth];
            row.depth = depth;
            row.splits = splits;
            row.calibration = split.train.size();
            row.test = split.held_out.size();
            row.stated = calibration.confidence;
            double mean = 0, keeping = 0;
            for (const double rate : miss_rates(levels, calibration, test, row.depth)) {
                mean += rate / row.test;
                keeping += (rate <= config.miss_rate + 1e-12) / static_cast<double>(row.test);
            }
            row.keeping += keeping / splits;
            row.nodes_missing += mean / splits;
            row.highest = std::max(row.highest, mean);
        }
    }
    tell_progress("splits", splits, splits);
    return rows;
}

std::vector<RandomSplitsRow> check_random_splits(const TreeFile& file, BoundKind kind, FrameSource& source,
                                                 int splits) {
    const RecordingReader& recording = source.recording();
    const auto tree = refer_to(file.tree);
    std::vector<FrameId> pool = frames_of(recording, file.facts.split, FrameSet::calibration);
    const std::vector<FrameId> held_out = frames_of(recording, file.facts.split, FrameSet::held_out);
    pool.insert(pool.end(), held_out.begin(), held_out.end());
    std::ranges::sort(pool);
    CalibrateConfig config;
    if (const auto found = tree->calibrations.find(kind); found != tree->calibrations.end())
        config = {.miss_rate = found->second.miss_rate, .confidence = found->second.confidence};
    const std::vector<FrameId> known =
        spread(frames_of(recording, file.facts.split, FrameSet::train), config.shape_poses);
    std::vector<FrameId> used = known;
    used.insert(used.end(), pool.begin(), pool.end());
    std::ranges::sort(used);
    if (source.hashes(used).hex != file.facts.recording_hash)
        throw std::invalid_argument("random splits need the recording of the training");
    return check_random_splits(BoundLevels(*tree, kind), score_shape(file.X, tree, kind, source, known),
                               score_bounds(file.X, tree, kind, source, pool), config, splits);
}

std::string to_text(const std::vector<RandomSplitsRow>& rows) {
    std::string text = fmt::format(
        "{} random splits, {} trajectories to calibrate on and {} to test on; "
        "stated: {:.4g} % keep the rate\n"
        "  depth  trajectories that keep it %  nodes that miss %, mean  worst split\n",
        rows[0].splits, rows[0].calibration, rows[0].test, 100 * rows[0].stated);
    for (const RandomSplitsRow& r : rows)
        text += fmt::format("  {:5}  {:27.2f}  {:23.4f}  {:11.4f}\n", r.depth, 100 * r.keeping,
                            100 * r.nodes_missing, 100 * r.highest);
    return text;
}

}  // namespace nbd
