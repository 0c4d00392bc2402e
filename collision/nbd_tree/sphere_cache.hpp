#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "collision/bounds/calibration.hpp"
#include "collision/geometry/bounding_sphere.hpp"
#include "collision/geometry/positions.hpp"
#include "collision/nbd_tree/bound.hpp"
#include "collision/nbd_tree/sphere_tree.hpp"

namespace nbd {

/// The spheres of one pose, each computed on first use.
class SphereCache {
 public:
    /// tree: must outlive this object. Until the first pose the nodes have its rest spheres.
    SphereCache(const SphereTree& tree, NodeMargins margins)
        : tree_(&tree), node_margins_(std::move(margins)), spheres_(tree.rest), poses_(tree.rest.size(), 0) {}

    /// x: must stay valid until the next pose.
    void begin_pose(const Positions& x) noexcept {
        x_ = x;
        ++pose_;
        bounded_ = 0;
        out_of_range_ = 0;
        met_non_finite_ = false;
    }

    /// Ends the pose: as before the first one.
    void forget_pose() noexcept {
        begin_pose({});
        pose_ = 0;
        std::ranges::fill(poses_, pose_);
        spheres_ = tree_->rest;
    }

    template <Bound B>
    const Sphere& get(int node, B& bounds) noexcept {
        const std::size_t i = node;
        if (poses_[i] != pose_) {
            spheres_[i] = compute(node, bounds);
            poses_[i] = pose_;
            met_non_finite_ |= !(0 * (spheres_[i].c.sum() + spheres_[i].r) == 0);
            ++bounded_;
        }
        return spheres_[i];
    }

    /// Number of nodes computed in this pose, and how many of them exactly because their input was out of
    /// range.
    int bounded() const noexcept { return bounded_; }
    int out_of_range() const noexcept { return out_of_range_; }
    /// Whether a sphere of this pose is not finite: a position that it was made from is not, or they
    /// overflow.
    bool met_non_finite() const noexcept { return met_non_finite_; }

 private:
    template <Bound B>
    Sphere compute(int node, B& bounds) noexcept {
        const std::size_t i = node;
        Sphere sphere = bounds.bound(node);
        float margin = node_margins_.margins[i];
        if constexpr (GatedBound<B>)
            if (!node_margins_.limits.empty()) {
                const float ood_score = bounds.ood_score(node);
                if (!(ood_score <= node_margins_.limits[i])) return exact_sphere(node);
                margin *= margin_weight(ood_score, node_margins_.limits[i]);
            }
        sphere.r *= 1 + margin;
        return sphere;
    }

    Sphere exact_sphere(int node) noexcept {
        ++out_of_range_;
        x_.require(tree_->node_vertices(node));
        return bounding_sphere(x_.rows(), tree_->node_vertices(node));
    }

    const SphereTree* tree_;
    NodeMargins node_margins_;
    std::vector<Sphere> spheres_;
    std::vector<std::uint64_t> poses_;  // [nodes] pose for which each sphere was computed
    Positions x_;
    std::uint64_t pose_ = 0;
    int bounded_ = 0, out_of_range_ = 0;
    bool met_non_finite_ = false;
};

}  // namespace nbd
