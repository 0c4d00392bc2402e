#pragma once

#include <algorithm>
#include <concepts>
#include <cstdint>
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
/// leaves, fitted where a query looks. Without a pose it is not to be walked, and nodes have their rest
/// spheres.
class PosedNbdTree {
 public:
    using Bounds = std::variant<ExactBound, BdBound, NbdBound>;
    static_assert(Bound<ExactBound> && Bound<BdBound> && GatedBound<NbdBound>);

    /// tree, F: of the surface; must outlive this object. margins: of all nodes.
    PosedNbdTree(const SphereTree& tree, const Faces& F, int vertex_count, Bounds bounds, NodeMargins margins)
        : tree_(&tree),
          bounds_(std::move(bounds)),
          spheres_(tree, std::move(margins)),
          leaves_(tree, F, vertex_count) {}

    /// Starts a pose. Exact bounds read every vertex now, the others their representatives; queries later
    /// read what they look at. x: must stay valid until the next pose.
    void begin_pose(const VertexView& x) noexcept;
    /// Ends the pose: as before the first one.
    void forget_pose() noexcept;
    bool has_pose() const noexcept { return x_.count() > 0; }
    const VertexView& positions() const noexcept { return x_; }

    const SphereTree& tree() const noexcept { return *tree_; }
    /// World-space sphere of a node.
    const Sphere& sphere(int node) noexcept;
    /// Calls f(spheres), where spheres(node) is as sphere(node), but for the type of the bounds chosen once.
    template <class F>
    void with_spheres(const F& f) {
        std::visit(
            [&](auto& bounds) { f([&](int node) -> const Sphere& { return spheres_.get(node, bounds); }); },
            bounds_);
    }
    LeafBoxes& leaves() noexcept { return leaves_; }

    /// Number of distinct nodes bounded in this pose, and of those bounded exactly because their input was
    /// out of the calibrated range.
    int bounded() const noexcept { return spheres_.bounded(); }
    int out_of_range() const noexcept { return spheres_.out_of_range(); }
    /// Throws std::invalid_argument, naming the first vertex, if a position that was read in this pose so far
    /// is not finite.
    void require_finite() const;

    /// The faces in this pose, numbered by slot, and the number of the face in a slot.
    PosedFaces faces() const noexcept { return leaves_.faces(); }
    int face(int slot) const noexcept { return leaves_.face(slot); }

 private:
    const SphereTree* tree_;
    VertexView x_;
    Bounds bounds_;
    SphereCache spheres_;
    LeafBoxes leaves_;
};

}  // namespace nbd
