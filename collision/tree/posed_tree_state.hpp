#pragma once

#include <memory>
#include <optional>
#include <variant>

#include "collision/bounds/affine/affine_boxes.hpp"
#include "collision/bounds/certified/certified_bound.hpp"
#include "collision/bounds/exact/exact_bound.hpp"
#include "collision/bounds/exact/exact_boxes.hpp"
#include "collision/bounds/learned/auto_boxes.hpp"
#include "collision/bounds/learned/bd_bound.hpp"
#include "collision/bounds/learned/learned_boxes.hpp"
#include "collision/bounds/learned/learned_spheres.hpp"
#include "collision/bounds/learned/nbd_bound.hpp"
#include "collision/tree/leaf_boxes.hpp"
#include "collision/tree/posed_tree.hpp"
#include "collision/tree/sphere_cache.hpp"

namespace nbd {

/// A pose of the sphere tree, its bounds and the boxes under its leaves. Queries take the type of the bounds
/// out of the variant once and then run without a dispatch per node.
struct PosedSpheres {
    std::variant<ExactBound, ExactBoxes, BdBound, NbdBound, LearnedSpheres, LearnedBoxes, CertifiedBound,
                 AutoBoxes>
        bounds;
    SphereCache spheres;
    LeafBoxes boxes;

    void begin_pose(const Positions& x, std::span<const RegionMotion> motion) noexcept;
    int nodes_bounded() const noexcept;
    int nodes_out_of_range() const noexcept;
};

/// The data of a PosedTree, visible to the queries.
struct PosedTreeState {
    std::shared_ptr<const CollisionTree> tree;
    BoundKind kind;
    std::unique_ptr<PosedSpheres> posed_spheres;  // null: not needed so far
    std::optional<AffineBoxes> wide{};            // for `affine` and `boxes`
    Positions positions{};                        // for `boxes`: of the pose
    Vertices surface{};                           // for `affine`: positions for posed_spheres
    bool is_of_nodes = true;                      // for `affine`: the pose was given by nodes
    bool is_stale = false;                        // for both: posed_spheres has another pose

    /// The boxes of the wide tree; null if the body has none, or is an `affine` one in a pose given by
    /// positions.
    AffineBoxes* wide_pose() noexcept { return wide && is_of_nodes ? &*wide : nullptr; }

    /// The sphere tree in this pose. `affine` bodies and `boxes` make it, with exact boxes, when a query with
    /// a body of another kind, or a question about nodes, first needs it; it then reads the whole surface.
    PosedSpheres& spheres() noexcept;
};

}  // namespace nbd
