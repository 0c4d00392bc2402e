#include "training/calibrate/bound_scores.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "collision/kernels/box_pack.hpp"
#include "collision/nbd_tree/bd_bound.hpp"

namespace nbd {

BoundLevels::BoundLevels(const SphereTree& tree) {
    for (int depth = 0; depth <= tree.depth(); ++depth)
        begins.push_back(std::ranges::lower_bound(tree.nodes, depth, {}, &SphereTree::Node::depth) -
                         tree.nodes.begin());
    begins.push_back(tree.nodes.size());
}

BoundLevels::BoundLevels(const CollisionTree& tree, BoundKind kind) : BoundLevels(tree.spheres) {
    if (kind == BoundKind::learned_affine && tree.learned_affine) begins = tree.learned_affine->levels();
}

PoseRows scaled_coordinates(FrameSource& source, std::span<const FrameId> frames, const NbdModel& model) {
    const Eigen::Index m = model.mode_count();
    PoseRows scaled(frames.size(), m);
    std::vector<ModalCoordinatesScratch> scratch(frame_slots);
    std::vector<Eigen::VectorXf> z(frame_slots, Eigen::VectorXf(m));
    source.for_each_frame(frames, [&](int slot, int index, VerticesRef x) {
        const std::size_t s = slot;
        modal_coordinates(model.modes, x, scratch[s], z[s]);
        scaled.row(index) = (z[s] - model.z_centre).cwiseProduct(model.z_scale).transpose();
    });
    return scaled;
}

CoordinateSpread coordinate_spread(const PoseRows& z) {
    if (z.rows() == 0)
        throw std::invalid_argument("no poses to measure the spread of the modal coordinates on");
    const Eigen::Index m = z.cols();
    const Eigen::MatrixXd Z = z.cast<double>();
    const Eigen::RowVectorXd mean = Z.colwise().mean();
    const Eigen::MatrixXd centred = Z.rowwise() - mean;
    Eigen::MatrixXd covariance = centred.transpose() * centred / static_cast<double>(z.rows());
    constexpr double ridge = 1e-3;  // of the mean variance of a coordinate
    covariance.diagonal().array() += ridge * covariance.trace() / static_cast<double>(m) + 1e-12;
    const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
    return {mean.transpose().cast<float>(),
            factor.matrixL().solve(Eigen::MatrixXd::Identity(m, m)).cast<float>()};
}

void fit_coordinate_spread(const PoseRows& z, NbdModel& model) {
    CoordinateSpread spread = coordinate_spread(z);
    model.z_mean = std::move(spread.mean);
    model.z_whitening = std::move(spread.whitening);
}

namespace {

/// Largest distance of the listed vertices from a point.
double reach(VerticesRef x, std::span<const int> vertices, const Eigen::Vector3f& from) {
    double squared = 0;
    for (const int v : vertices)
        squared = std::max(squared, (x.row(v).transpose() - from).cast<double>().squaredNorm());
    return std::sqrt(squared);
}

constexpr int folds = 5;

/// The fold of each frame. Trajectories are assigned to folds in turn; a single trajectory is one fold.
std::vector<int> folds_of(std::span<const FrameId> frames) {
    std::vector<int> trajectories, fold;
    for (const FrameId& frame : frames) {
        const auto known = std::ranges::find(trajectories, frame.trajectory);
        fold.push_back((known - trajectories.begin()) % folds);
        if (known == trajectories.end()) trajectories.push_back(frame.trajectory);
    }
    return fold;
}

/// Fills in the margins that spheres needed; of `nbd` bounds also how far representatives stand outside, as
/// their scores, and the scaled modal coordinates z, [poses, m].
template <class B>
void score_spheres(const SphereTree& tree, const B& bounds, FrameSource& source,
                   std::span<const FrameId> frames, BoundScores& scores, PoseRows& z) {
    constexpr bool is_nbd = std::is_same_v<B, NbdBound>;
    std::vector<B> of_slot(frame_slots, bounds);
    source.for_each_frame(frames, [&](int slot, int index, VerticesRef x) {
        B& bound = of_slot[slot];
        bound.begin_pose(x);
        if constexpr (is_nbd) z.row(index) = bound.scaled_coordinates().transpose();
        for (int i = 0; i < scores.excess.cols(); ++i) {
            scores.excess(index, i) = sphere_excess(x, tree.node_vertices(i), bound.bound(i));
            if constexpr (is_nbd) scores.ood_score(index, i) = bound.outside(i);
        }
    });
}

/// Scores `nbd` bounds, each pose by the spread of the modal coordinates of the other folds' poses; by that
/// of the model if all are in one fold.
void score_nbd(const CollisionTree& tree, FrameSource& source, std::span<const FrameId> frames,
               std::span<const int> fold, BoundScores& scores) {
    const NbdModel& model = *tree.nbd;
    PoseRows z(frames.size(), model.mode_count());
    score_spheres(tree.spheres, NbdBound(tree.spheres, model), source, frames, scores, z);
    for (int left_out = 0; left_out < folds; ++left_out) {
        std::vector<Eigen::Index> rows, other_rows;
        for (std::size_t i = 0; i < fold.size(); ++i) (fold[i] == left_out ? rows : other_rows).push_back(i);
        if (rows.empty()) continue;
        const CoordinateSpread spread = other_rows.empty() ? CoordinateSpread{model.z_mean, model.z_whitening}
                                                           : coordinate_spread(z(other_rows, Eigen::all));
        Eigen::VectorXf difference(z.cols()), whitened(z.cols());
        for (const Eigen::Index p : rows) {
            const float coordinates = coordinate_ood_score(spread.mean, spread.whitening,
                                                           z.row(p).transpose(), difference, whitened);
            for (float& score : scores.ood_score.row(p)) score = nbd_ood_score(coordinates, score);
        }
    }
}

/// Fills in the margins that `learned_affine` needed, in spreads and residuals, and their scores.
void score_parts(const CollisionTree& tree, FrameSource& source, std::span<const FrameId> frames,
                 BoundScores& scores) {
    const LearnedAffineModel& model = *tree.learned_affine;
    const std::shared_ptr<const AffineModel> boxes = tree.boxes ? tree.boxes : make_boxes(tree);
    const WideTree& wide = boxes->tree();
    std::vector<WideBoxes> exact(frame_slots);
    source.for_each_frame(frames, [&](int slot, int index, VerticesRef x) {
        WideBoxes& truth = exact[slot];
        fit_wide_boxes(wide, x, truth);
        for (int c = 0; c < model.clusters(); ++c) {
            const std::size_t i = c;
            const ClusterSamples samples = model.cluster_samples(c, x.data());
            const float needed = outside(samples.box, truth.clusters[i]);
            scores.excess(index, c) =
                needed > 0 ? needed / samples.spread - model.fit().clusters[i].growth : -1.f;
            scores.ood_score(index, c) = model.cluster_score(c, samples.spread);
        }
        std::array<float, LearnedAffineModel::scratch> scratch;
        BoxPack mapped;
        for (int part = 0; part < model.parts(); ++part) {
            const float residual = model.map_children(part, x.data(), scratch.data(), mapped);
            const auto protrusions = model.protrusions(part, mapped, wide, truth);
            const float* growth = model.fit().growth.data() + std::ptrdiff_t{part} * tree_width;
            float excess = -1;
            for (std::size_t k = 0; k < protrusions.size(); ++k)
                if (protrusions[k] > 0) excess = std::max(excess, protrusions[k] / residual - growth[k]);
            scores.excess(index, model.clusters() + part) = excess;
            scores.ood_score(index, model.clusters() + part) = model.part_score(part, residual);
        }
    });
}

BoundScores score(const CollisionTree& tree, BoundKind kind, FrameSource& source,
                  std::span<const FrameId> frames, std::span<const int> fold) {
    if (!can_miss(kind) || !has_bounds(tree, kind))
        throw std::invalid_argument(fmt::format("the tree has no {} bounds to score", name(kind)));
    BoundScores scores{.trajectories = trajectories_of(source.recording(), frames), .excess{}, .ood_score{}};
    scores.excess.resize(frames.size(), bound_count(tree, kind));
    scores.ood_score.resize(frames.size(), kind == BoundKind::bd ? 0 : scores.excess.cols());
    PoseRows none;
    if (kind == BoundKind::learned_affine)
        score_parts(tree, source, frames, scores);
    else if (kind == BoundKind::nbd)
        score_nbd(tree, source, frames, fold, scores);
    else
        score_spheres(tree.spheres, BdBound(tree.spheres, *tree.bd), source, frames, scores, none);
    return scores;
}

}  // namespace

float sphere_excess(VerticesRef x, std::span<const int> vertices, const Sphere& sphere) {
    const double needed = reach(x, vertices, sphere.c);
    return needed > 0 ? static_cast<float>(needed / static_cast<double>(sphere.r) - 1) : -1.f;
}

std::vector<int> trajectories_of(const RecordingReader& recording, std::span<const FrameId> frames) {
    std::vector<int> ids;
    for (const FrameId& frame : frames) ids.push_back(recording.trajectories()[frame.trajectory].id);
    return ids;
}

BoundScores score_bounds(const CollisionTree& tree, BoundKind kind, FrameSource& source,
                         std::span<const FrameId> frames) {
    return score(tree, kind, source, frames, std::vector<int>(frames.size(), 0));
}

BoundScores score_shape(const CollisionTree& tree, BoundKind kind, FrameSource& source,
                        std::span<const FrameId> frames) {
    return score(tree, kind, source, frames, folds_of(frames));
}

}  // namespace nbd
