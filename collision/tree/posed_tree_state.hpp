#pragma once

#include <memory>
#include <variant>

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

/// The data of a PosedTree, visible to the queries: they take the type of the bounds out of the variant once
/// and then run without a dispatch per node.
struct PosedTreeState {
    std::shared_ptr<const CollisionTree> tree;
    BoundKind kind;
    std::variant<ExactBound, ExactBoxes, BdBound, NbdBound, LearnedSpheres, LearnedBoxes, CertifiedBound,
                 AutoBoxes>
        bounds;
    SphereCache spheres;
    LeafBoxes boxes;

    void begin_pose(const Positions& x, std::span<const RegionMotion> motion) noexcept;
};

}  // namespace nbd
