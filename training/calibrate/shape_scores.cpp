#include "training/calibrate/shape_scores.hpp"

#include <algorithm>
#include <vector>

#include "collision/nbd_tree/nbd_bound.hpp"
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

/// Scores of `nbd` bounds, each pose by the spread of the modal coordinates of the other folds' poses.
BoundScores score_by_other_folds(const CollisionTree& tree, FrameSource& source,
                                 std::span<const FrameId> frames, std::span<const int> fold) {
    const Eigen::Index poses = frames.size(), nodes = tree.spheres.nodes.size();
    BoundScores scores{trajectories_of(source.recording(), frames), PoseRows(poses, nodes),
                       PoseRows(poses, nodes)};
    PoseRows z(poses, tree.nbd->mode_count());
    std::vector<NbdBound> bounds(frame_slots, NbdBound(tree.spheres, *tree.nbd));
    source.for_each_frame(frames, [&](int slot, int index, VerticesRef x) {
        NbdBound& bound = bounds[slot];
        bound.begin_pose(x);
        z.row(index) = bound.scaled_coordinates().transpose();
        for (int i = 0; i < nodes; ++i) {
            scores.excess(index, i) = sphere_excess(x, tree.spheres.node_vertices(i), bound.bound(i));
            scores.ood_score(index, i) = bound.outside(i);
        }
    });
    for (int left_out = 0; left_out < folds; ++left_out) {
        std::vector<Eigen::Index> rows, other_rows;
        for (std::size_t i = 0; i < fold.size(); ++i) (fold[i] == left_out ? rows : other_rows).push_back(i);
        if (rows.empty()) continue;
        const CoordinateSpread spread = coordinate_spread(z(other_rows, Eigen::all));
        Eigen::VectorXf difference(z.cols()), whitened(z.cols());
        for (const Eigen::Index p : rows) {
            const float coordinates = coordinate_ood_score(spread.mean, spread.whitening,
                                                           z.row(p).transpose(), difference, whitened);
            for (float& score : scores.ood_score.row(p)) score = nbd_ood_score(coordinates, score);
        }
    }
    return scores;
}

}  // namespace

BoundScores score_shape(VerticesRef X, const std::shared_ptr<const CollisionTree>& tree, BoundKind kind,
                        FrameSource& source, std::span<const FrameId> frames) {
    const std::vector<int> fold = folds_of(frames);
    if (kind != BoundKind::nbd || fold.empty() || std::ranges::max(fold) == 0)
        return score_bounds(X, tree, kind, source, frames);
    return score_by_other_folds(*tree, source, frames, fold);
}

}  // namespace nbd
