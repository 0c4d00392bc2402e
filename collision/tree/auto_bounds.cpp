#include "collision/tree/auto_bounds.hpp"

namespace nbd {

BoundKind bounds_of_auto(const CollisionTree& tree, bool by_nodes, std::optional<float> margin) noexcept {
    constexpr Eigen::Index many_faces = 100'000;
    if (by_nodes && tree.affine) return BoundKind::affine;
    const bool is_large = tree.faces.rows() >= many_faces;
    return is_large && is_usable(tree, BoundKind::learned_affine, margin) ? BoundKind::learned_affine
                                                                          : BoundKind::boxes;
}

BoundKind exact_for_auto(const CollisionTree& tree, BoundKind kind) noexcept {
    if (kind != BoundKind::automatic) return kind;
    return tree.affine ? BoundKind::affine : BoundKind::boxes;
}

}  // namespace nbd
