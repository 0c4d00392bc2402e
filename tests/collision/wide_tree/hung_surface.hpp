#pragma once

#include <memory>
#include <random>

#include "collision/geometry/embedding.hpp"
#include "collision/tree/collision_tree.hpp"
#include "tests/support/shapes.hpp"

namespace nbd::test {

/// A surface that hangs on nodes, x = W nodes.
struct HungSurface {
    shapes::Surface surface;  // X = W rest, in float32
    SurfaceEmbedding W;
    Vertices rest;  // of the nodes
};

/// Hangs a surface on a lattice of cells x cells x cells cubes with the eight weights of trilinear
/// interpolation.
HungSurface hung_on_lattice(const shapes::Surface& surface, int cells);

/// Likewise with the four weights of the tetrahedron around each vertex; every cube has six.
HungSurface hung_on_tets(const shapes::Surface& surface, int cells);

/// A surface whose vertices are the nodes.
HungSurface hung_on_itself(const shapes::Surface& surface);

/// A tree of the surface with `affine` bounds besides the exact ones.
std::shared_ptr<const CollisionTree> hung_tree(const HungSurface& hung, const SphereTreeConfig& config = {});

/// Poses of nodes that no simulator would give: twisted, crushed to a plane, turned inside out, scattered,
/// far away, tiny.
Vertices wild_pose(const Vertices& rest, int kind, std::mt19937& random);
inline constexpr int wild_poses = 7;

}  // namespace nbd::test
