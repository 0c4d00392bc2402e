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

/// Box and statistics of a node's samples in a pose.
struct SampleBox {
    Box box;              // box of the samples
    float spread = 0;     // spread of the samples, see BoxFit
    float ood_score = 0;  // see GatedBound: distance of spread^2 from its mean in training, in standard
                          // deviations
};

/// Box of a node's samples; for exact nodes it is the node's exact box. Call positions.require() for the
/// samples first.
SampleBox sample_box(const LearnedModel& model, int node, const Positions& positions) noexcept;

/// Learned boxes: the axis-aligned boxes of nodes' samples, grown by amounts from training and calibration. A
/// node reads its samples on first use in a pose and, if these are out of the calibrated range, all its
/// vertices.
class LearnedBoxes {
 public:
    /// tree, model: must outlive this object. margins: in units of the samples' spread.
    LearnedBoxes(const SphereTree& tree, const LearnedModel& model, const NodeMargins& margins);

    /// x: must stay valid until the next pose.
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
    /// Prefetch what box(node) will read, if it reads anything: first the node, then its list of samples,
    /// then their positions.
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

    /// Number of nodes computed in this pose, and how many of them exactly because their input was out of
    /// range.
    int bounded() const noexcept { return bounded_; }
    int out_of_range() const noexcept { return out_of_range_; }
    /// Whether a position that was read in this pose was not finite.
    bool met_non_finite() const noexcept { return met_non_finite_; }

 private:
    /// All data of a node except its samples, on one cache line.
    struct alignas(64) Node {
        Box box = empty_box();
        BoxFit fit;
        float margin = 0, limit = 0;  // a limit below 0 means no limit
        int sample_begin = 0;
        std::int16_t sample_count = 0;
        bool exact = false;
        std::uint32_t pose = 0;  // pose for which the box was computed
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
    bool met_non_finite_ = false;
};

}  // namespace nbd
