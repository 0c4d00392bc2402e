#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "apps/bench/physics/physics_check.hpp"
#include "meshing/body/body.hpp"
#include "meshing/surface/mesh.hpp"
#include "sim/world/world.hpp"

namespace nbd {

constexpr double standard_gravity = 9.81;  // m/s2

/// A box around the origin, of cells that are cut into six tetrahedra each.
TetMesh brick(const Eigen::Vector3d& size, const Eigen::Vector3i& cells);

/// A cube of the case's size.
TetMesh cube(const PhysicsCase& c, int cells = 2);

/// Nodes at positions that `test` accepts.
template <class Test>
std::vector<int> nodes_at(const Nodes& X, const Test& test) {
    std::vector<int> found;
    for (int i = 0; i < X.rows(); ++i)
        if (test(Eigen::Vector3d(X.row(i)))) found.push_back(i);
    return found;
}

/// The case's material without damping by mass; all else as by default.
Material plain_material(const PhysicsCase& c);
/// The same without any damping.
Material undamped_material(const PhysicsCase& c);
Material undamped_material(const PhysicsCase& c, double poisson);

/// What bodies of one shape and material share. Their surface is that of the tetrahedra, their tree as a
/// scene makes it.
struct Solid {
    Body body;
    std::shared_ptr<const ElasticBody> elastic;
    std::shared_ptr<const CollisionTree> tree;

    Solid(TetMesh mesh, const Material& material);
    explicit Solid(Body of);

    /// At rest, rotated about the origin, moved there, with this velocity and rotation about its centre.
    WorldBody at(const Eigen::Vector3d& centre, const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero(),
                 const Eigen::Vector3d& spin = Eigen::Vector3d::Zero(),
                 const Eigen::Matrix3d& R = Eigen::Matrix3d::Identity()) const;
};

/// A rigid box around the origin. density: kg/m3.
Solid rigid_box(const Eigen::Vector3d& size, double density = 1000);

/// A body without a tree, which only obstacles can touch.
WorldBody alone(const std::shared_ptr<const ElasticBody>& elastic);

/// Settings of a case: gravity along -z, all else as by default.
WorldConfig config_of();

/// The same without gravity.
WorldConfig weightless();

/// A world of these bodies and obstacles. The case's far body comes last, if it has one; a force carries its
/// weight.
World world_of(const PhysicsCase& c, const WorldConfig& config, std::vector<WorldBody> bodies,
               const std::vector<Obstacle>& obstacles = {});

/// A ball around the origin: an icosahedron whose faces are split into four `level` times, filled with
/// tetrahedra. poles > 1 crowds the vertices at both ends of the z axis. May be called by several threads.
TetMesh ball(double radius, int level, double poles = 1);

/// The surface of a box around the origin, of square cells.
TriMesh box_surface(const Eigen::Vector3d& size, const Eigen::Vector3i& cells);

/// Fills a surface with linear tetrahedra of its own triangles. May be called by several threads.
TetMesh filled(const TriMesh& surface);

// A bar ten times as long as it is wide and deep, which bends, twists and rings.

/// Torsion constant of a square section by its side to the fourth [TimoshenkoGoodier70].
constexpr double torsion_constant = 0.140577;

/// Shear coefficient of a rectangular section [Cowper66].
double shear_coefficient(double poisson);

/// Parts of a case's variant: its bar has the surface of CAD, the others' four cells across; it has quadratic
/// tetrahedra, half as long as a bar of CAD is thick, the others linear ones on the surface's own triangles.
inline const std::string twelve_triangles = "twelve triangles", quadratic_elements = "quadratic";
/// Likewise: the tetrahedra that `nbdtree mesh` finds by default.
inline const std::string as_meshed = "as meshed by default";

/// The tetrahedra as elements of the case's kind.
TetMesh elements_of(const PhysicsCase& c, TetMesh linear);

/// The bar, as long as the case's size, along x around the origin. parameter: Poisson's ratio.
TetMesh bar_mesh(const PhysicsCase& c);

/// What comes to rest in one step so long that inertia vanishes.
inline const PhysicsRange still_range{.sizes = {1}, .steps = {1e5}, .moduli = {1e7}, .far = FarBody::none};

/// The cases, and the same of quadratic elements.
std::vector<PhysicsCase> with_quadratic(std::vector<PhysicsCase> cases);

/// The same of these bars as they are meshed by default, over Poisson's ratios.
std::vector<PhysicsCase> meshed_bars(const std::string& variant, const std::vector<double>& ratios);

/// Bars over Poisson's ratio (the parameter), over sizes and moduli, and of both kinds of elements.
std::vector<PhysicsCase> bar_cases();

/// Of waves in one dimension, m/s.
double speed_of_sound(const PhysicsCase& c);

Obstacle floor_plane(double friction, double height = 0);

/// Steps the world. Throws std::runtime_error where a step fails.
void advance(World& world, double dt, int steps = 1);

/// Elastic and kinetic energy of a body, and that of its height under `gravity` along -z, J.
double energy(const World& world, int body, double gravity);

// Of one body: centre of mass, momentum, and angular momentum about the origin.
Eigen::Vector3d mass_centre(const World& world, int body);
Eigen::Vector3d momentum(const World& world, int body);
Eigen::Vector3d angular_momentum(const World& world, int body);

/// Mean acceleration of body 0 along x, m/s2, once it slides evenly from where contact begins.
double sliding_acceleration(const PhysicsCase& c, World& world);

/// Mean force of contact on a body in the last step, N.
Eigen::Vector3d contact_force(const World& world, int body);

}  // namespace nbd
