#pragma once

#include <memory>
#include <span>
#include <vector>

#include "collision/bounds/affine/affine_boxes.hpp"
#include "collision/bounds/affine/learned_affine_boxes.hpp"
#include "collision/bounds/affine/wide_boxes.hpp"
#include "collision/tree/collision_tree.hpp"

namespace nbd {

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
    static constexpr int levels = 3;

    /// tree: has such bounds and their calibration; must outlive this object.
    explicit WideCoverage(const CollisionTree& tree);

    /// One outcome for each of LearnedAffineModel::bounds(), valid until the next call.
    std::span<const WideOutcome> measure(VerticesRef x);

 private:
    /// A node of the wide tree: its exact box and its leaves.
    struct Node {
        const Box& exact;
        int first_leaf, end_leaf;
    };
    Node cluster(int i) const;
    Node block(int i) const;
    Node leaf(int i) const;
    void add(const Box& box, const Node& node, VerticesRef x, WideOutcome& outcome) const;

    std::shared_ptr<const AffineModel> model_;
    const WideTree* tree_;
    AffineBoxes boxes_;
    LearnedAffineBoxes learned_;  // the same, to ask which are out of range
    Vertices x_;                  // of its pose
    WideBoxes exact_;
    std::vector<WideOutcome> outcomes_;
};

}  // namespace nbd
