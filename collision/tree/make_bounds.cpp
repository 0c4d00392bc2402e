#include "collision/tree/make_bounds.hpp"

#include <stdexcept>
#include <string>
#include <utility>

#include "collision/base/message.hpp"

namespace nbd {
namespace {

using Bounds = decltype(PosedSpheres::bounds);

Bounds make_bounds(const CollisionTree& tree, BoundKind kind) {
    if (kind == BoundKind::exact) return ExactBound(tree.spheres);
    if (is_box(kind) && has_bounds(tree, kind)) return ExactBoxes(tree.spheres);
    if (kind == BoundKind::bd && tree.bd) return BdBound(tree.spheres, *tree.bd);
    if (kind == BoundKind::nbd && tree.nbd) return NbdBound(tree.spheres, *tree.nbd);
    std::string available = "exact";
    for (const BoundKind other : bound_kinds)
        if (other != BoundKind::exact && has_bounds(tree, other)) available.append(", ").append(name(other));
    throw std::invalid_argument(
        message("the collision tree has no model for \"", name(kind), "\" bounds, only for ", available));
}

NodeMargins no_margins(const CollisionTree& tree) {
    return {std::vector<float>(tree.spheres.nodes.size(), 0.f), {}};
}

}  // namespace

void check_calibrated(const CollisionTree& tree, BoundKind kind, std::optional<float> margin) {
    if (has_bounds(tree, kind) && !is_usable(tree, kind, margin))
        throw std::invalid_argument(message(
            "the tree's \"", name(kind),
            "\" bounds are not calibrated, so that nodes miss at no stated rate; run `nbdtree calibrate` "
            "on the tree, or give a margin (--margin)"));
}

std::unique_ptr<PosedSpheres> make_spheres(const CollisionTree& tree, BoundKind kind,
                                           std::optional<float> margin) {
    return std::make_unique<PosedSpheres>(PosedSpheres{
        make_bounds(tree, kind),
        SphereCache(tree.spheres, is_box(kind) ? no_margins(tree) : node_margins(tree, kind, margin)),
        LeafBoxes(tree)});
}

}  // namespace nbd
