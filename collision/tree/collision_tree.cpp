#include "collision/tree/collision_tree.hpp"

#include <stdexcept>

#include "collision/base/message.hpp"

namespace nbd {
namespace {

/// Whether a model has as many vertices and parts as the wide tree of the faces.
bool fits(const LearnedAffineModel& model, const CollisionTree& tree) {
    if (model.fit().X.rows() != tree.vertex_count) return false;
    const std::shared_ptr<const AffineModel> boxes = tree.boxes ? tree.boxes : make_boxes(tree);
    const WideTree& wide = boxes->tree();
    return model.clusters() == wide.clusters() && model.parts() == wide.clusters() + wide.blocks();
}

}  // namespace

CollisionTree make_exact_tree(VerticesRef X, FacesRef F, const SphereTreeConfig& config) {
    CollisionTree tree;
    tree.spheres = build_sphere_tree(X, F, config);
    tree.vertex_count = X.rows();
    tree.faces = F;
    tree.boxes = make_boxes(tree);
    return tree;
}

std::shared_ptr<const AffineModel> make_boxes(const CollisionTree& tree) {
    return std::make_shared<const AffineModel>(
        build_wide_tree(tree.spheres.faces, tree.faces, tree.vertex_count));
}

void hang_on_nodes(CollisionTree& tree, const SurfaceEmbedding& W, VerticesRef rest) {
    tree.affine = std::make_shared<const AffineModel>(tree.faces, tree.vertex_count, W, rest);
}

std::shared_ptr<const CollisionTree> shared_exact_tree(VerticesRef X, FacesRef F,
                                                       const SphereTreeConfig& config) {
    return std::make_shared<const CollisionTree>(make_exact_tree(X, F, config));
}

void check_collision_tree(const CollisionTree& tree) {
    check_sphere_tree(tree.spheres, tree.vertex_count, tree.faces);
    if (tree.bd) check_bd_model(*tree.bd, tree.spheres, tree.vertex_count);
    if (tree.nbd) check_nbd_model(*tree.nbd, tree.spheres, tree.vertex_count);
    if (tree.affine && !is_over(tree.affine->tree(), tree.vertex_count, tree.faces))
        throw std::invalid_argument(
            "the affine model is of another surface; allowed: one of the tree's faces");
    if (tree.boxes && !(is_over(tree.boxes->tree(), tree.vertex_count, tree.faces) &&
                        tree.boxes->node_count() == tree.vertex_count && tree.boxes->rounding() == 0))
        throw std::invalid_argument("the boxes are of another surface; allowed: those of make_boxes()");
    if (tree.learned_affine && !fits(*tree.learned_affine, tree))
        throw std::invalid_argument(
            "learned affine bounds are of another surface; allowed: bounds over the tree's wide tree");
    for (const auto& [kind, calibration] : tree.calibrations) {
        if (!has_bounds(tree, kind))
            throw std::invalid_argument(
                message("calibration of ", name(kind), " bounds, but the tree has no model for them"));
        check_calibration(calibration, name(kind), bound_count(tree, kind));
    }
}

void require_other_bounds(const CollisionTree& tree) {
    for (const BoundKind kind : bound_kinds)
        if (!is_exact(kind) && kind != BoundKind::automatic && has_bounds(tree, kind)) return;
    throw std::invalid_argument(
        "holds no bounds but ones that are gone; train the tree anew, or use the body without a tree");
}

bool is_usable(const CollisionTree& tree, BoundKind kind, std::optional<float> margin) noexcept {
    return has_bounds(tree, kind) && (!can_miss(kind) || margin || tree.calibrations.contains(kind));
}

std::size_t bound_count(const CollisionTree& tree, BoundKind kind) noexcept {
    if (kind == BoundKind::learned_affine && tree.learned_affine) return tree.learned_affine->bounds();
    return tree.spheres.nodes.size();
}

NodeMargins node_margins(const CollisionTree& tree, BoundKind kind, std::optional<float> margin) {
    const auto calibration = tree.calibrations.find(kind);
    if (margin || calibration == tree.calibrations.end())
        return {std::vector<float>(bound_count(tree, kind), margin.value_or(0.f)), {}};
    return {calibration->second.margins, calibration->second.limits};
}

bool has_bounds(const CollisionTree& tree, BoundKind kind) noexcept {
    switch (kind) {
        case BoundKind::exact:
        case BoundKind::boxes:
        case BoundKind::automatic:
            return true;
        case BoundKind::bd:
            return tree.bd.has_value();
        case BoundKind::nbd:
            return tree.nbd.has_value();
        case BoundKind::learned_affine:
            return tree.learned_affine != nullptr;
        case BoundKind::affine:
            return tree.affine != nullptr;
    }
    return false;
}

}  // namespace nbd
