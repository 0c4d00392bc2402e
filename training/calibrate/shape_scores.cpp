#include "training/calibrate/shape_scores.hpp"

#include <algorithm>
#include <vector>

#include "training/calibrate/coordinate_spread.hpp"

namespace nbd {
namespace {

constexpr int folds = 5;

/// The fold of each frame. Trajectories are assigned to folds in turn; a single trajectory is one fold.
std::vector<int> folds_of(std::span<const FrameId> frames) {
    std::vector<int> trajectories, fold;
    for (const FrameId& frame : frames) {
        const auto known = std::ranges::find(trajectories, frame.trajectory);
        fold.push_back(static_cast<int>(known - trajectories.begin()) % folds);
        if (known == trajectories.end()) trajectories.push_back(frame.trajectory);
    }
    return fold;
}

}  // namespace

BoundScores score_shape(const SurfaceBody& body, const CollisionTree& tree, BoundKind kind,
                        const RecordingReader& recording, std::span<const FrameId> frames) {
    const auto shared = [](const CollisionTree& t) { return std::make_shared<const CollisionTree>(t); };
    const std::vector<int> fold = folds_of(frames);
    if (kind != BoundKind::nbd || fold.empty() || std::ranges::max(fold) == 0)
        return score_bounds(body, shared(tree), kind, recording, frames);
    CollisionTree others = tree;
    const PoseRows z = scaled_coordinates(body, recording, frames, *tree.nbd);
    const auto poses = static_cast<Eigen::Index>(frames.size()),
               nodes = static_cast<Eigen::Index>(tree.spheres.nodes.size());
    BoundScores scores{std::vector<int>(frames.size()), PoseRows(poses, nodes), PoseRows(poses, nodes)};
    for (int left_out = 0; left_out < folds; ++left_out) {
        std::vector<Eigen::Index> rows, other_rows;
        std::vector<FrameId> own;
        for (std::size_t i = 0; i < frames.size(); ++i) {
            (fold[i] == left_out ? rows : other_rows).push_back(static_cast<Eigen::Index>(i));
            if (fold[i] == left_out) own.push_back(frames[i]);
        }
        if (own.empty()) continue;
        fit_coordinate_spread(z(other_rows, Eigen::all), *others.nbd);
        const BoundScores part = score_bounds(body, shared(others), kind, recording, own);
        for (std::size_t i = 0; i < rows.size(); ++i)
            scores.trajectories[static_cast<std::size_t>(rows[i])] = part.trajectories[i];
        scores.excess(rows, Eigen::all) = part.excess;
        scores.ood_score(rows, Eigen::all) = part.ood_score;
    }
    return scores;
}

}  // namespace nbd
