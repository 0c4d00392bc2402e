#pragma once

#include <optional>
#include <variant>

#include "collision/nbd_tree/bd_bound.hpp"
#include "collision/nbd_tree/exact_bound.hpp"
#include "collision/nbd_tree/leaf_boxes.hpp"
#include "collision/nbd_tree/nbd_bound.hpp"
#include "collision/nbd_tree/sphere_cache.hpp"

namespace nbd {

/// A sphere tree in a pose: the bounds of its nodes, each computed on first use, and the boxes under its
/// leaves, fitted where a query looks. Without a pose it is not to be walked, and nodes have their rest
/// spheres.
class PosedNbdTree {
 public:
    using Bounds = std::variant<ExactBound, BdBound, NbdBound>;

    /// tree, F: of the surface; must outlive this object. margins: of all nodes.
    PosedNbdTree(const SphereTree& tree, const Faces& F, int vertex_count, Bounds bounds, NodeMargins margins)
        : tree_(&tree),
          bounds_(std::move(bounds)),
          spheres_(tree, std::move(margins)),
          leaves_(tree, F, vertex_count) {}

    /// Starts a pose. Exact bounds read every vertex now, the others their representatives; queries later
    /// read what they look at. x: must stay valid until the next pose.
    void begin_pose(const Positions& x) noexcept;
    /// Ends the pose: as before the first one.
    void forget_pose() noexcept;
    bool has_pose() const noexcept { return x_.rows().rows() > 0; }
    const Positions& positions() const noexcept { return x_; }

    const SphereTree& tree() const noexcept { return *tree_; }
    /// World-space sphere of a node.
    const Sphere& sphere(int node) noexcept;
    /// Out-of-distribution score of a node's input, see GatedBound; empty for bounds without one.
    std::optional<float> ood_score(int node) noexcept;
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
    /// is not finite. Positions computed on demand are not searched: their nodes are to be checked.
    void require_finite() const;

    /// The faces in this pose, numbered by slot, and the number of the face in a slot.
    PosedFaces faces() const noexcept { return leaves_.faces(); }
    int face(int slot) const noexcept { return leaves_.face(slot); }

 private:
    const SphereTree* tree_;
    Positions x_;
    Bounds bounds_;
    SphereCache spheres_;
    LeafBoxes leaves_;
};

}  // namespace nbd
