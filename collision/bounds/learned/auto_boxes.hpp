#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "collision/bounds/exact/exact_boxes.hpp"
#include "collision/bounds/learned/learned_boxes.hpp"

namespace nbd {

/// Boxes that are exact or learned, chosen for each pose by which was cheaper in the previous pose. Exact
/// boxes read every vertex in each pose; the cost of learned boxes is proportional to the nodes that a query
/// asks for. The choice uses counts, not a clock, so the same poses give the same results.
class AutoBoxes {
 public:
    /// tree, model: must outlive this object. If the model is null or has no boxes, boxes are always exact.
    /// margins: see LearnedBoxes.
    AutoBoxes(const SphereTree& tree, const LearnedModel* model, const NodeMargins& margins);

    /// x: must stay valid until the next pose.
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

    /// Number of nodes asked for in this pose, and how many learned ones of them were out of range.
    int bounded() const noexcept { return learned_ ? learned_boxes_->bounded() : bounded_; }
    int out_of_range() const noexcept { return learned_ ? learned_boxes_->out_of_range() : 0; }
    /// Whether the boxes of this pose are learned.
    bool learned() const noexcept { return learned_; }

 private:
    bool learned_is_cheaper(bool on_demand) const noexcept;

    const SphereTree* tree_;
    ExactBoxes exact_;
    std::optional<LearnedBoxes> learned_boxes_;
    double samples_ = 0;                // mean number of samples per node
    std::vector<std::uint64_t> asked_;  // [nodes] last pose in which the exact box was asked for
    std::uint64_t pose_ = 0;
    int bounded_ = 0;
    bool learned_ = false;
};

}  // namespace nbd
