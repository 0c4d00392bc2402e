#pragma once

#include <memory>

#include "collision/collision_tree.hpp"
#include "meshing/mesh.hpp"

namespace nbd {

/// A collision tree that needs no training: for exact bounds.
/// Throws std::invalid_argument where the surface is unusable; see build_sphere_tree().
inline std::shared_ptr<const CollisionTree> exact_tree(const TriMesh& surface) {
    CollisionTree tree;
    tree.vertex_count = static_cast<int>(surface.X.rows());
    tree.faces = surface.F;
    tree.spheres = build_sphere_tree(surface.X.cast<float>(), surface.F);
    return std::make_shared<const CollisionTree>(std::move(tree));
}

}  // namespace nbd
