#include "training/calibrate/calibrate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "training/calibrate/statistics.hpp"
#include "training/files/recording.hpp"
#include "training/files/split.hpp"

namespace nbd {
namespace {

constexpr float never = -std::numeric_limits<float>::infinity();

/// Added to margins, so that rounding makes no pose miss that needs exactly the margin.
constexpr float rounding = 1e-6f;

/// Columns of a level's bounds, which are consecutive: the first one and their number.
struct Level {
    Eigen::Index begin = 0, count = 0;
};

Level level_of(const BoundLevels& levels, int depth) {
    const int* begin = levels.begins.data() + depth;
    return {begin[0], begin[1] - begin[0]};
}

void check(const BoundLevels& levels, const BoundScores& scores) {
    const Eigen::Index poses = scores.trajectories.size();
    const Eigen::Index nodes = levels.begins.back();
    if (poses == 0) throw std::invalid_argument("no poses to calibrate on");
    if (scores.excess.rows() != poses || scores.excess.cols() != nodes || scores.ood_score.rows() != poses ||
        (scores.ood_score.cols() != 0 && scores.ood_score.cols() != nodes))
        throw std::invalid_argument(fmt::format("scores of {} x {} numbers for {} poses and {} nodes",
                                                scores.excess.rows(), scores.excess.cols(), poses, nodes));
}

/// The margin that each node needed in each pose; `never` where the node is bounded exactly.
PoseRows needed_margins(const Calibration& calibration, const BoundScores& scores) {
    PoseRows needed = scores.excess;
    for (Eigen::Index p = 0; p < scores.ood_score.rows(); ++p)
        for (Eigen::Index i = 0; i < scores.ood_score.cols(); ++i) {
            const float ood_score = scores.ood_score(p, i), limit = calibration.limits[i];
            needed(p, i) =
                limit > 0 && ood_score <= limit ? needed(p, i) / margin_weight(ood_score, limit) : never;
        }
    return needed;
}

/// Groups the numbers of a depth's nodes by trajectory.
TrajectoryScores by_trajectory(const PoseRows& numbers, std::span<const int> trajectories,
                               const Level& level) {
    std::vector<int> ids;
    TrajectoryScores groups;
    for (std::size_t p = 0; p < trajectories.size(); ++p) {
        const auto found = std::ranges::find(ids, trajectories[p]);
        const std::size_t group = found - ids.begin();
        if (found == ids.end()) {
            ids.push_back(trajectories[p]);
            groups.emplace_back();
        }
        const float* row = numbers.row(p).data() + level.begin;
        groups[group].insert(groups[group].end(), row, row + level.count);
    }
    return groups;
}

/// True if the node's ood_score is always 0, that is, its bound is exact in every pose.
bool always_exact(const Calibration& calibration, Eigen::Index node) {
    return !calibration.limits.empty() && calibration.limits[node] == 0;
}

int count_trajectories(std::vector<int> ids) {
    std::ranges::sort(ids);
    return std::unique(ids.begin(), ids.end()) - ids.begin();
}

/// Limit of each node's ood_score that at most this share of the poses exceeds; finite, and 0 only if the
/// score is always 0.
std::vector<float> range_limits(const PoseRows& ood_score, double share) {
    std::vector<float> limits, column;
    for (Eigen::Index i = 0; i < ood_score.cols(); ++i) {
        column.assign(ood_score.col(i).begin(), ood_score.col(i).end());
        const float level = level_at_rate(column, share);
        limits.push_back(
            std::min(level > 0 ? level : std::ranges::max(column), std::numeric_limits<float>::max()));
    }
    return limits;
}

/// The margin that each node needs for this miss rate, >= 0.
Eigen::RowVectorXf first_margins(const PoseRows& needed, double rate) {
    Eigen::RowVectorXf margins(needed.cols());
    std::vector<float> column;
    for (Eigen::Index i = 0; i < needed.cols(); ++i) {
        column.assign(needed.col(i).begin(), needed.col(i).end());
        margins[i] = std::max(0.f, level_at_rate(column, rate));
        if (!std::isfinite(margins[i]))
            throw std::runtime_error(
                fmt::format("cannot calibrate node {}: its bound has radius 0 in too many poses", i));
    }
    return margins;
}

/// The complete trajectories of another recording that training has not seen, in two halves.
DatasetSplit halves_of_others(const RecordingReader& recording, const RecordingHash& hashes,
                              const TrainingFacts& facts) {
    std::vector<int> known;
    if (facts.trained_on) {
        const SeenTrajectories* const seen[] = {&*facts.trained_on};
        known = known_trajectories(recording, hashes, seen);
        tell_left_out(recording, known, "trained on");
    } else {
        tell_unknown(recording);
    }
    std::vector<int> ids;
    for (const TrajectoryInfo& t : recording.trajectories())
        if (t.failure.empty() && t.frames > 0 && !std::ranges::binary_search(known, t.id))
            ids.push_back(t.id);
    if (ids.size() < 2)
        throw std::runtime_error(
            fmt::format("{}: {} complete trajectories that the tree was not trained on; allowed: "
                        "at least 2 to calibrate on",
                        recording.path().string(), ids.size()));
    return draw_held_out(std::move(ids), 0.5, 0);
}

}  // namespace

Calibration calibrate(const BoundLevels& levels, const BoundScores& shape, const BoundScores& scores,
                      const CalibrateConfig& config) {
    check(levels, shape);
    check(levels, scores);
    Calibration calibration{.miss_rate = config.miss_rate,
                            .confidence = 0,
                            .trajectories = count_trajectories(scores.trajectories),
                            .poses = scores.excess.rows()};
    const std::size_t trajectories = calibration.trajectories;
    calibration.confidence = config.confidence.value_or(std::min(0.9, max_confidence(trajectories)));
    calibration.limits = range_limits(shape.ood_score, config.out_of_range);
    constexpr double caution = 0.1;
    const Eigen::RowVectorXf first =
        first_margins(needed_margins(calibration, shape), caution * config.miss_rate);
    // The need beyond the first margin is the conformal score.
    PoseRows lifts = needed_margins(calibration, scores).rowwise() - first;
    const std::size_t bounds = levels.begins.back();
    calibration.margins.resize(bounds);
    for (int depth = 0; depth < levels.count(); ++depth) {
        const Level level = level_of(levels, depth);
        const TrajectoryScores groups = by_trajectory(lifts, scores.trajectories, level);
        const float lift = std::max({0.f, confident_level(groups, config.miss_rate, calibration.confidence),
                                     mean_level(groups, config.miss_rate)});
        if (lift == INFINITY)
            throw std::runtime_error(
                fmt::format("cannot calibrate depth {}: its bounds have radius 0 in too many poses", depth));
        for (Eigen::Index i = level.begin; i < level.begin + level.count; ++i)
            calibration.margins[i] = always_exact(calibration, i) ? 0 : first[i] + lift + rounding;
    }
    check_calibration(calibration, "the", bounds);
    return calibration;
}

void calibrate(TreeFile& file, FrameSource& source, const CalibrateConfig& config) {
    const RecordingReader& recording = source.recording();
    check_recording(file.facts.body_hash, file.W.cols(), recording);
    if (source.W().rows() != file.W.rows())
        throw std::invalid_argument(fmt::format("frames of a surface of {} vertices for a tree of {}",
                                                source.W().rows(), file.W.rows()));
    std::vector<FrameId> shape = frames_of(recording, file.facts.split, FrameSet::train),
                         frames = frames_of(recording, file.facts.split, FrameSet::calibration);
    std::vector<FrameId> used = spread(shape, config.shape_poses);
    used.insert(used.end(), frames.begin(), frames.end());
    std::ranges::sort(used);
    const RecordingHash& hashes = source.hashes(used);
    std::vector<int> calibrated_on = file.facts.split.calibration_trajectories;
    if (hashes.hex == file.facts.recording_hash) {
        if (!file.facts.trained_on)
            file.facts.trained_on = seen_trajectories(recording, hashes, file.facts.split.train_trajectories);
    } else {
        const DatasetSplit halves = halves_of_others(recording, hashes, file.facts);
        TrainingSplit split{.train_trajectories = halves.train, .held_out_trajectories = halves.held_out};
        split.troubled_frames = file.facts.split.troubled_frames;
        shape = frames_of(recording, split, FrameSet::train);
        frames = frames_of(recording, split, FrameSet::held_out);
        calibrated_on = halves.train;
        calibrated_on.insert(calibrated_on.end(), halves.held_out.begin(), halves.held_out.end());
    }
    if (frames.empty())
        throw std::runtime_error(
            fmt::format("{}: no trajectories to calibrate on; training kept none for calibration",
                        recording.path().string()));
    shape = spread(shape, config.shape_poses);
    if (file.tree.nbd)
        fit_coordinate_spread(scaled_coordinates(source, shape, *file.tree.nbd), *file.tree.nbd);
    file.facts.calibrated_on = seen_trajectories(recording, hashes, calibrated_on);
    file.tree.calibrations.clear();
    for (const BoundKind kind : bound_kinds) {
        if (!can_miss(kind) || !has_bounds(file.tree, kind)) continue;
        const BoundScores known = score_shape(file.tree, kind, source, shape);
        const BoundScores scores = score_bounds(file.tree, kind, source, frames);
        try {
            file.tree.calibrations[kind] = calibrate(BoundLevels(file.tree, kind), known, scores, config);
        } catch (const std::runtime_error& e) {
            throw std::runtime_error(fmt::format("{} bounds: {}", name(kind), e.what()));
        }
    }
}

void calibrate(TreeFile& file, const RecordingReader& recording, const CalibrateConfig& config) {
    FrameSource source(file.W, recording);
    calibrate(file, source, config);
}

}  // namespace nbd
