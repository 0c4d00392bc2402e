#pragma once

#include <memory>
#include <variant>

#include "collision/auto_boxes.hpp"
#include "collision/bd_bound.hpp"
#include "collision/certified/certified_bound.hpp"
#include "collision/exact_bound.hpp"
#include "collision/exact_boxes.hpp"
#include "collision/leaf_boxes.hpp"
#include "collision/local_bound.hpp"
#include "collision/local_boxes.hpp"
#include "collision/modal_bound.hpp"
#include "collision/posed_tree.hpp"
#include "collision/sphere_cache.hpp"

namespace nbd {

/// What a PosedTree holds; for the queries, which take the type of the bounds out of the variant once and
/// then run without a dispatch per node.
struct PosedTreeState {
    std::shared_ptr<const CollisionTree> tree;
    BoundKind kind;
    std::variant<ExactBound, ExactBoxes, BdBound, ModalBound, LocalBound, LocalBoxes, CertifiedBound,
                 AutoBoxes>
        bounds;
    SphereCache spheres;
    LeafBoxes boxes;

    void begin_pose(const Positions& x, std::span<const RegionMotion> motion) noexcept;
};

}  // namespace nbd
