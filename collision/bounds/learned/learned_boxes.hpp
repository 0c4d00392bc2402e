#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "collision/base/prefetch.hpp"
#include "collision/bounds/bound.hpp"
#include "collision/bounds/learned/learned_model.hpp"
#include "collision/bounds/node_margins.hpp"
#include "collision/geometry/bounding_box.hpp"
#include "collision/geometry/positions.hpp"
#include "collision/topology/sphere_tree.hpp"

namespace nbd {

/// What the samples of a node say of its box in a pose.
struct SampleBox {
    Box box;              // of the samples
    float spread = 0;     // of the samples, see LearnedModel::BoxFit
    float ood_score = 0;  // see GatedBound: how far spread^2 lies from its mean in training, in standard
                          // deviations
};

/// positions: whose samples of the node have been required. Exact nodes: their very box.
SampleBox sample_box(const LearnedModel& model, int node, const Positions& positions) noexcept;

/// Axis-aligned boxes from the samples of local bounds, grown by what training and calibration say. A node
/// reads its own samples when it is first asked for in a pose; where these are out of the calibrated range,
/// all its vertices.
class LearnedBoxes {
 public:
    /// tree and model: referred to. trust: margins in spreads.
    LearnedBoxes(const SphereTree& tree, const LearnedModel& model, const NodeMargins& margins);

    /// x: referred to until the next pose.
    void begin_pose(const Positions& x) noexcept;

    const Box& box(int node) noexcept {
        Node& n = nodes_[static_cast<std::size_t>(node)];
        if (n.pose != pose_) {
            n.box = compute(node, n);
            n.pose = pose_;
            ++bounded_;
        }
        return n.box;
    }
    /// Have the cache bring what box(node) will read, where that reads anything: first the node, then which
    /// samples it has, then where these are.
    void prefetch_node(int node) const noexcept { prefetch_line(&nodes_[static_cast<std::size_t>(node)]); }
    void prefetch_samples(int node) const noexcept {
        const Node& n = nodes_[static_cast<std::size_t>(node)];
        if (n.pose != pose_) prefetch_lines(samples_of(n));
    }
    void prefetch_positions(int node) const noexcept {
        const Node& n = nodes_[static_cast<std::size_t>(node)];
        if (n.pose != pose_) x_.prefetch(samples_of(n));
    }
    /// The sphere around that box.
    Sphere bound(int node) noexcept { return sphere_around(box(node)); }

    /// Nodes computed in this pose, and how many of them exactly, their inputs being out of range.
    int bounded() const noexcept { return bounded_; }
    int out_of_range() const noexcept { return out_of_range_; }

 private:
    /// All that a node's box takes but for its samples, on one line of the cache.
    struct alignas(64) Node {
        Box box = empty_box();
        LearnedModel::BoxFit fit;
        float margin = 0, limit = 0;  // below 0: none
        int sample_begin = 0;
        std::int16_t sample_count = 0;
        bool exact = false;
        std::uint32_t pose = 0;  // that the box belongs to
    };
    static_assert(sizeof(Node) == 64 && LearnedModel::max_samples <= INT16_MAX);

    std::span<const int> samples_of(const Node& n) const noexcept {
        return {model_->samples.data() + n.sample_begin, static_cast<std::size_t>(n.sample_count)};
    }
    Box compute(int node, const Node& n) noexcept;

    const SphereTree* tree_;
    const LearnedModel* model_;
    std::vector<Node> nodes_;
    Positions x_;
    std::uint32_t pose_ = 0;
    int bounded_ = 0, out_of_range_ = 0;
};

}  // namespace nbd
