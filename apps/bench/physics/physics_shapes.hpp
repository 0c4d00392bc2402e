#pragma once

#include <vector>

#include "apps/bench/physics/physics_check.hpp"
#include "meshing/body/body.hpp"
#include "meshing/surface/mesh.hpp"

namespace nbd {

/// A ball around the origin: an icosahedron whose faces are split into four `level` times, filled with
/// tetrahedra. poles > 1 crowds the vertices at both ends of the z axis. May be called by several threads.
TetMesh ball(double radius, int level, double poles = 1);

/// The surface of a box around the origin, of square cells.
TriMesh box_surface(const Eigen::Vector3d& size, const Eigen::Vector3i& cells);

/// Fills a surface as `nbdtree mesh` does by default. May be called by several threads.
TetMesh filled(const TriMesh& surface);

// A bar ten times as long as it is wide and deep, which bends, twists and rings.

/// Torsion constant of a square section by its side to the fourth [TimoshenkoGoodier70].
constexpr double torsion_constant = 0.140577;

/// Shear coefficient of a rectangular section [Cowper66].
double shear_coefficient(double poisson);

/// The variant of a case whose bar has the surface of CAD; the others' has four cells across.
inline const char* const twelve_triangles = "twelve triangles";

/// The bar, as long as the case's size, along x around the origin.
TetMesh bar_mesh(const PhysicsCase& c);

/// The case's material without damping.
Material undamped_material(const PhysicsCase& c, double poisson);

/// What comes to rest in one step so long that inertia vanishes.
inline const PhysicsRange still_range{
    .sizes = {1}, .steps = {1e5}, .moduli = {1e7}, .modes = {false}, .far = FarBody::none};

/// Bars over Poisson's ratio (the parameter), and over sizes and moduli.
std::vector<PhysicsCase> bar_cases();

}  // namespace nbd
