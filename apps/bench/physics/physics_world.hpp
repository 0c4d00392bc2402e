#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "apps/bench/physics/physics_check.hpp"
#include "meshing/body/body.hpp"
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

/// What bodies of one shape and material share. Their surface is that of the tetrahedra, their tree as a
/// scene makes it.
struct Solid {
    Body body;
    std::shared_ptr<const ElasticBody> elastic;
    std::shared_ptr<const CollisionTree> tree;

    Solid(TetMesh mesh, const Material& material);

    /// At rest, rotated about the origin, moved there, with this velocity and rotation about its centre.
    WorldBody at(const Eigen::Vector3d& centre, const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero(),
                 const Eigen::Vector3d& spin = Eigen::Vector3d::Zero(),
                 const Eigen::Matrix3d& R = Eigen::Matrix3d::Identity()) const;
};

/// A body without a tree, which only obstacles can touch.
WorldBody alone(const std::shared_ptr<const ElasticBody>& elastic);

/// Settings of a case: gravity along -z, all else as by default.
WorldConfig config_of(const PhysicsCase& c);

/// Adds the case's far body, if it has one; a force carries its weight. Call it after the bodies of the
/// check.
void add_far_body(World& world, const PhysicsCase& c);

/// Of waves in one dimension, m/s.
double speed_of_sound(const PhysicsCase& c);

Obstacle floor_plane(double friction, double height = 0);

/// Steps the world. Throws std::runtime_error where a step fails.
WorldReport advance(World& world, double dt);

// Of one body: centre of mass, momentum, and angular momentum about the origin.
Eigen::Vector3d mass_centre(const World& world, int body);
Eigen::Vector3d momentum(const World& world, int body);
Eigen::Vector3d angular_momentum(const World& world, int body);

/// Mean force of contact on a body in the last step, N.
Eigen::Vector3d contact_force(const World& world, int body);

}  // namespace nbd
