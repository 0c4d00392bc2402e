#pragma once

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "collision/bounds/calibration.hpp"
#include "collision/nbd_tree/bd_bound.hpp"
#include "collision/nbd_tree/exact_bound.hpp"
#include "collision/nbd_tree/leaf_boxes.hpp"
#include "collision/nbd_tree/nbd_bound.hpp"
#include "collision/nbd_tree/sphere_tree.hpp"

namespace nbd {

/// Bounds the nodes of a sphere tree in any pose, in world space. begin_pose() is called first for each pose,
/// then bound() for nodes in any order; a repeated call gives the same. Neither throws or allocates.
template <class B>
concept Bound = requires(B bounds, const Vertices& x, int node) {
    bounds.begin_pose(x);
    { bounds.bound(node) } -> std::same_as<Sphere>;
};

/// A bound with an out-of-distribution score. ood_score() refers to the node of the last call of bound(): how
/// far its input lies from the centre of the training inputs, >= 0, in any unit; NaN for NaN input; always 0
/// for a node that is exact in every pose. Calibrated margins grow with the score, and above a calibrated
/// limit the node is bounded exactly instead. The better the score separates easy poses from hard ones, the
/// smaller the margins.
template <class B>
concept GatedBound = Bound<B> && requires(B bounds, int node) {
    { bounds.ood_score(node) } -> std::same_as<float>;
};

/// The spheres of one pose, each computed on first use.
class SphereCache {
 public:
    /// tree: must outlive this object. Until the first pose the nodes have its rest spheres.
    SphereCache(const SphereTree& tree, NodeMargins margins)
        : tree_(&tree), node_margins_(std::move(margins)), spheres_(tree.rest), poses_(tree.rest.size(), 0) {}

    /// x: must stay valid until the next pose.
    void begin_pose(const VertexView& x) noexcept {
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
        return get(node, bounds, [](const Sphere& sphere) { return sphere; });
    }
    /// Likewise, but holds larger(sphere) for a node instead of its sphere, which is made when the node is
    /// first asked for in a pose.
    template <Bound B, class Larger>
    const Sphere& get(int node, B& bounds, const Larger& larger) noexcept {
        const std::size_t i = node;
        if (poses_[i] != pose_) {
            spheres_[i] = larger(compute(node, bounds));
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
        return bounding_sphere(x_.rows(), tree_->node_vertices(node));
    }

    const SphereTree* tree_;
    NodeMargins node_margins_;
    std::vector<Sphere> spheres_;
    std::vector<std::uint64_t> poses_;  // [nodes] pose for which each sphere was computed
    VertexView x_;
    std::uint64_t pose_ = 0;
    int bounded_ = 0, out_of_range_ = 0;
    bool met_non_finite_ = false;
};

/// A sphere tree in a pose: the bounds of its nodes, each computed on first use, and the boxes under its
/// leaves, fitted where a query looks. In a step of linear motion, likewise over the whole step. Without a
/// pose it is not to be walked, and nodes have their rest spheres.
class PosedNbdTree {
 public:
    using Bounds = std::variant<ExactBound, BdBound, NbdBound>;
    static_assert(Bound<ExactBound> && Bound<BdBound> && GatedBound<NbdBound>);

    /// tree, F: of the surface; must outlive this object. margins: of all nodes.
    PosedNbdTree(const SphereTree& tree, const Faces& F, int vertex_count, Bounds bounds, NodeMargins margins)
        : tree_(&tree),
          posed_{{}, std::move(bounds), {tree, std::move(margins)}},
          leaves_(tree, F, vertex_count) {}

    /// Starts a pose. Exact bounds read every vertex now, the others their representatives; queries later
    /// read what they look at. x: must stay valid until the next pose or step.
    void begin_pose(const VertexView& x) noexcept;
    /// Starts a step, in which every vertex moves straight: the sphere of a node is the smallest around those
    /// of its poses at the start and at the end. start, end: read like x of begin_pose(). Throws
    /// std::bad_alloc, and has changed nothing then: the first step allocates a second set of bounds, unless
    /// reserve() did.
    void begin_step(const VertexView& start, const VertexView& end);
    /// Makes room for steps.
    void reserve();
    /// Ends the pose or step: as before the first one.
    void forget_pose() noexcept;
    bool has_pose() const noexcept { return posed_.x.count() > 0; }
    bool in_step() const noexcept { return in_step_; }
    /// Positions in the pose, or at the end of the step.
    const VertexView& positions() const noexcept { return posed_.x; }
    /// Positions at the start of the step. Only in a step.
    const VertexView& start() const noexcept { return at_start_->x; }

    const SphereTree& tree() const noexcept { return *tree_; }
    /// World-space sphere of a node, in the pose or over the step.
    const Sphere& sphere(int node) noexcept { return in_step_ ? sphere_of_step(node) : posed_.sphere(node); }
    /// Calls f(spheres), where spheres(node) is as sphere(node), but for the type of the bounds chosen once.
    template <class F>
    void with_spheres(const F& f) {
        if (in_step_) return f([&](int node) -> const Sphere& { return sphere_of_step(node); });
        std::visit(
            [&](auto& bounds) {
                f([&](int node) -> const Sphere& { return posed_.spheres.get(node, bounds); });
            },
            posed_.bounds);
    }
    LeafBoxes& leaves() noexcept { return leaves_; }

    /// Number of distinct nodes bounded in this pose, and of those bounded exactly because their input was
    /// out of the calibrated range. In a step a node counts twice, once for each end.
    int bounded() const noexcept {
        return posed_.spheres.bounded() + (in_step_ ? at_start_->spheres.bounded() : 0);
    }
    int out_of_range() const noexcept {
        return posed_.spheres.out_of_range() + (in_step_ ? at_start_->spheres.out_of_range() : 0);
    }
    /// Throws std::invalid_argument, naming the first vertex, if a position that was read in this pose or
    /// step so far is not finite.
    void require_finite() const;

    /// The faces in this pose, or at the end of the step, numbered by slot, and the number of the face in a
    /// slot.
    PosedFaces faces() const noexcept { return leaves_.faces(); }
    int face(int slot) const noexcept { return leaves_.face(slot); }

 private:
    /// The bounds of all nodes in one pose.
    struct Posed {
        VertexView x;
        Bounds bounds;
        SphereCache spheres;

        void begin_pose(const VertexView& positions) noexcept;
        const Sphere& sphere(int node) noexcept;
        bool met_non_finite() const noexcept;
    };

    const Sphere& sphere_of_step(int node) noexcept;

    const SphereTree* tree_;
    Posed posed_;                    // in the pose, or at the end of the step; then holds spheres of the step
    std::optional<Posed> at_start_;  // empty before the first step; stale in a pose
    bool in_step_ = false;
    LeafBoxes leaves_;
};

}  // namespace nbd
