#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "collision/bounds/exact/exact_boxes.hpp"
#include "collision/bounds/learned/learned_boxes.hpp"

namespace nbd {

/// Boxes of a body that are exact or learned, pose by pose, whichever was cheaper for the pose before: exact
/// ones cost the same for every pose, a look at every vertex, learned ones by the node that a query asks for.
/// Decided by counts and not by a clock, so that the same poses give the same results.
class AutoBoxes {
 public:
    /// tree and model: referred to. model: none, or one without boxes: always exact. trust: see LearnedBoxes.
    AutoBoxes(const SphereTree& tree, const LearnedModel* model, const NodeMargins& margins);

    /// x: referred to until the next pose.
    void begin_pose(const Positions& x) noexcept;

    const Box& box(int node) noexcept {
        if (learned_) return learned_boxes_->box(node);
        std::uint64_t& asked = asked_[static_cast<std::size_t>(node)];
        bounded_ += asked != pose_;
        asked = pose_;
        return exact_.box(node);
    }
    Sphere bound(int node) noexcept { return sphere_around(box(node)); }
    void prefetch_node(int node) const noexcept {
        if (learned_) learned_boxes_->prefetch_node(node);
    }
    void prefetch_samples(int node) const noexcept {
        if (learned_) learned_boxes_->prefetch_samples(node);
    }
    void prefetch_positions(int node) const noexcept {
        if (learned_) learned_boxes_->prefetch_positions(node);
    }

    /// Nodes that were asked for in this pose, and how many of learned ones' were out of range.
    int bounded() const noexcept { return learned_ ? learned_boxes_->bounded() : bounded_; }
    int out_of_range() const noexcept { return learned_ ? learned_boxes_->out_of_range() : 0; }
    /// Whether this pose's boxes are learned ones.
    bool learned() const noexcept { return learned_; }

 private:
    bool learned_is_cheaper(bool on_demand) const noexcept;

    const SphereTree* tree_;
    ExactBoxes exact_;
    std::optional<LearnedBoxes> learned_boxes_;
    double samples_ = 0;                // of a node, mean
    std::vector<std::uint64_t> asked_;  // [nodes] the last pose in which an exact box was asked for
    std::uint64_t pose_ = 0;
    int bounded_ = 0;
    bool learned_ = false;
};

}  // namespace nbd
