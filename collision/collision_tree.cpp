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
}

std::string_view name(BoundKind kind) noexcept {
    switch (kind) {
        case BoundKind::exact:
            return "exact";
        case BoundKind::bd:
            return "bd";
        case BoundKind::modal:
            return "modal";
    }
    return "unknown";
}

BoundKind bound_kind(std::string_view name) {
    for (const BoundKind kind : {BoundKind::exact, BoundKind::bd, BoundKind::modal})
        if (name == nbd::name(kind)) return kind;
    throw std::invalid_argument(message("unknown bounds \"", name, "\", known: exact, bd, modal"));
}

}  // namespace nbd
