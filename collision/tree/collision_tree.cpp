#include "collision/tree/collision_tree.hpp"

#include <stdexcept>

#include "collision/base/message.hpp"

namespace nbd {
CollisionTree make_exact_tree(VerticesRef X, FacesRef F, const SphereTreeConfig& config) {
    CollisionTree tree;
    tree.spheres = build_sphere_tree(X, F, config);
    tree.vertex_count = static_cast<int>(X.rows());
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
    if (tree.learned) check_learned_model(*tree.learned, tree.spheres, tree.vertex_count);
    if (tree.affine && !is_over(tree.affine->tree(), tree.vertex_count, tree.faces))
        throw std::invalid_argument(
            "the affine model is of another surface; allowed: one of the tree's faces");
    if (tree.boxes && !(is_over(tree.boxes->tree(), tree.vertex_count, tree.faces) &&
                        tree.boxes->node_count() == tree.vertex_count && tree.boxes->rounding() == 0))
        throw std::invalid_argument("the boxes are of another surface; allowed: those of make_boxes()");
    if (tree.certified) check_certified_model(*tree.certified, tree.spheres, tree.vertex_count);
    for (const auto& [kind, calibration] : tree.calibrations) {
        if (!has_bounds(tree, kind))
            throw std::invalid_argument(
                message("calibration of ", name(kind), " bounds, but the tree has no model for them"));
        check_calibration(calibration, name(kind), tree.spheres.nodes.size());
    }
}

BoundKind exact_for_auto(const CollisionTree& tree, BoundKind kind) noexcept {
    if (kind != BoundKind::automatic) return kind;
    return tree.affine ? BoundKind::affine : BoundKind::boxes;
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
        case BoundKind::learned_spheres:
            return tree.learned.has_value();
        case BoundKind::learned_boxes:
            return tree.learned && !tree.learned->boxes.empty();
        case BoundKind::certified:
            return tree.certified.has_value();
        case BoundKind::affine:
            return tree.affine != nullptr;
    }
    return false;
}

}  // namespace nbd
