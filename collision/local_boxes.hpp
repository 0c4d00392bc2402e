#pragma once

#include <cstdint>
#include <vector>

#include "collision/bound.hpp"
#include "collision/bounding_box.hpp"
#include "collision/local_model.hpp"
#include "collision/positions.hpp"
#include "collision/sphere_tree.hpp"
#include "collision/trust.hpp"

namespace nbd {

/// What the samples of a node say of its box in a pose.
struct SampleBox {
    Box box;                // of the samples
    float spread = 0;       // of the samples, see LocalModel::BoxFit
    float strangeness = 0;  // see GatedBound: how far spread^2 lies from its mean in training, in standard
                            // deviations
};

/// positions: whose samples of the node have been required. Exact nodes: their very box.
SampleBox sample_box(const LocalModel& model, int node, const Positions& positions) noexcept;

/// Axis-aligned boxes from the samples of local bounds, grown by what training and calibration say. A node
/// reads its own samples when it is first asked for in a pose; where these are out of the calibrated range,
/// all its vertices.
class LocalBoxes {
 public:
    /// tree and model: referred to. trust: margins in spreads.
    LocalBoxes(const SphereTree& tree, const LocalModel& model, Trust trust);

    /// x: referred to until the next pose.
    void begin_pose(const Positions& x) noexcept;

    const Box& box(int node) noexcept {
        Entry& entry = entries_[static_cast<std::size_t>(node)];
        if (entry.pose != pose_) {
            entry.box = compute(node);
            entry.pose = pose_;
            ++bounded_;
        }
        return entry.box;
    }
    /// Have the cache bring what box(node) will read, where that reads anything: first where the node keeps
    /// it, then which samples, then where these are.
    void fetch_node(int node) const noexcept {
        fetch_line(&entries_[static_cast<std::size_t>(node)]);
        fetch_line(&model_->nodes[static_cast<std::size_t>(node)]);
    }
    void fetch_samples(int node) const noexcept {
        if (entries_[static_cast<std::size_t>(node)].pose != pose_) fetch_lines(model_->node_samples(node));
    }
    void fetch_positions(int node) const noexcept {
        if (entries_[static_cast<std::size_t>(node)].pose != pose_) x_.fetch(model_->node_samples(node));
    }
    /// The sphere around that box.
    Sphere bound(int node) noexcept { return sphere_around(box(node)); }

    /// Nodes computed in this pose, and how many of them exactly, their inputs being out of range.
    int bounded() const noexcept { return bounded_; }
    int out_of_range() const noexcept { return out_of_range_; }

 private:
    struct Entry {
        Box box;
        std::uint64_t pose = 0;
    };

    Box compute(int node) noexcept;

    const SphereTree* tree_;
    const LocalModel* model_;
    Trust trust_;
    std::vector<Entry> entries_;
    Positions x_;
    std::uint64_t pose_ = 0;
    int bounded_ = 0, out_of_range_ = 0;
};

}  // namespace nbd
