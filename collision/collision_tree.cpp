#include "collision/collision_tree.hpp"

#include <stdexcept>

#include "collision/message.hpp"

namespace nbd {

CollisionTree make_exact_tree(VerticesRef X, FacesRef F, const SphereTreeConfig& config) {
    CollisionTree tree;
    tree.spheres = build_sphere_tree(X, F, config);
    tree.vertex_count = static_cast<int>(X.rows());
    tree.faces = F;
    return tree;
}

void check_collision_tree(const CollisionTree& tree) {
    check_sphere_tree(tree.spheres, tree.vertex_count, tree.faces);
    if (tree.bd) check_bd_model(*tree.bd, tree.spheres, tree.vertex_count);
    if (tree.modal) check_modal_model(*tree.modal, tree.spheres, tree.vertex_count);
    if (tree.local) check_local_model(*tree.local, tree.spheres, tree.vertex_count);
    if (tree.certified) check_certified_model(*tree.certified, tree.spheres, tree.vertex_count);
    for (const auto& [kind, calibration] : tree.calibrations) {
        if (!has_bounds(tree, kind))
            throw std::invalid_argument(
                message("calibration of ", name(kind), " bounds, which the tree has not"));
        check_calibration(calibration, name(kind), tree.spheres.nodes.size());
    }
}

bool has_bounds(const CollisionTree& tree, BoundKind kind) noexcept {
    switch (kind) {
        case BoundKind::exact:
        case BoundKind::boxes:
        case BoundKind::automatic:
            return true;
        case BoundKind::bd:
            return tree.bd.has_value();
        case BoundKind::modal:
            return tree.modal.has_value();
        case BoundKind::local:
            return tree.local.has_value();
        case BoundKind::local_boxes:
            return tree.local && !tree.local->boxes.empty();
        case BoundKind::certified:
            return tree.certified.has_value();
    }
    return false;
}

std::string_view name(BoundKind kind) noexcept {
    switch (kind) {
        case BoundKind::exact:
            return "exact";
        case BoundKind::boxes:
            return "boxes";
        case BoundKind::bd:
            return "bd";
        case BoundKind::modal:
            return "modal";
        case BoundKind::local:
            return "local";
        case BoundKind::local_boxes:
            return "local_boxes";
        case BoundKind::certified:
            return "certified";
        case BoundKind::automatic:
            return "auto";
    }
    return "unknown";
}

BoundKind bound_kind(std::string_view name) {
    for (const BoundKind kind : bound_kinds)
        if (name == nbd::name(kind)) return kind;
    throw std::invalid_argument(
        message("unknown bounds \"", name,
                "\", known: exact, boxes, bd, modal, local, local_boxes, certified, auto"));
}

}  // namespace nbd
