#pragma once

#include <memory>
#include <span>
#include <vector>

#include "collision/bounds/affine/affine_boxes.hpp"
#include "collision/bounds/affine/learned_affine_boxes.hpp"
#include "collision/bounds/affine/wide_boxes.hpp"
#include "collision/tree/collision_tree.hpp"

namespace nbd {

/// A `learned_affine` box of a node of the wide tree in a pose.
struct WideNode {
    int level = 0;  // 0: clusters, 1: blocks, 2: leaves
    int bound = 0;  // of LearnedAffineModel::bounds(); boxes that share a margin follow each other
    bool out_of_range = false;  // the box is the exact one instead
    Box box, exact;
    int first_leaf = 0, end_leaf = 0;
};

/// The `learned_affine` boxes of all nodes of a wide tree beside the exact ones, pose by pose.
class WideNodes {
 public:
    static constexpr int levels = 3;

    /// tree: has such bounds; must outlive this object.
    WideNodes(const CollisionTree& tree, const NodeMargins& margins);

    /// All boxes, in the order of their bounds; valid until the next call.
    std::span<const WideNode> pose(VerticesRef x);

    /// Vertices of a node; one counts once for each leaf that has it.
    long vertices(const WideNode& node) const;
    /// How many of them a box leaves outside. x: of the last pose.
    long outside(const WideNode& node, const Box& box, VerticesRef x) const;

 private:
    std::shared_ptr<const AffineModel> model_;
    const WideTree* tree_;
    AffineBoxes boxes_;
    LearnedAffineBoxes learned_;  // the same, to ask which are out of range
    Vertices x_;                  // of its pose
    WideBoxes exact_;
    std::vector<WideNode> nodes_;
};

/// Boxes that share a margin, against the exact ones in a pose.
struct WideOutcome {
    int level = 0;                   // boxes of clusters, of blocks, of leaves
    long vertices = 0, outside = 0;  // a vertex counts once for each leaf that has it
    bool out_of_range = false;
    double inflation = 0;  // mean of diagonal / exact diagonal - 1
};

/// Compares `learned_affine` boxes, as calibrated, with the exact ones, pose by pose.
class WideCoverage {
 public:
    static constexpr int levels = WideNodes::levels;

    /// tree: has such bounds and their calibration; must outlive this object.
    explicit WideCoverage(const CollisionTree& tree);

    /// One outcome for each of LearnedAffineModel::bounds(), valid until the next call.
    std::span<const WideOutcome> measure(VerticesRef x);

 private:
    WideNodes nodes_;
    std::vector<WideOutcome> outcomes_;
};

/// Length of a box's diagonal.
double diagonal(const Box& box) noexcept;

}  // namespace nbd
