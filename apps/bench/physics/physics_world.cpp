#include "apps/bench/physics/physics_world.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "meshing/body/make_body.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/world/hang_on_body.hpp"

namespace nbd {

TetMesh brick(const Eigen::Vector3d& size, const Eigen::Vector3i& cells) {
    const auto node = [&](const Eigen::Vector3i& at) {
        return (at[0] * (cells[1] + 1) + at[1]) * (cells[2] + 1) + at[2];
    };
    TetMesh mesh{Nodes(node(cells) + 1, 3), Tets(6 * cells.prod(), 4)};
    Eigen::Vector3i at;
    for (at[0] = 0; at[0] <= cells[0]; ++at[0])
        for (at[1] = 0; at[1] <= cells[1]; ++at[1])
            for (at[2] = 0; at[2] <= cells[2]; ++at[2])
                mesh.X.row(node(at)) =
                    (at.cast<double>().cwiseQuotient(cells.cast<double>()).array() - 0.5) * size.array();
    // From the lowest corner of a cell to its highest, along the axes in every order.
    constexpr int paths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    constexpr bool turns_left[6] = {true, false, false, true, true, false};
    int tet = 0;
    for (at[0] = 0; at[0] < cells[0]; ++at[0])
        for (at[1] = 0; at[1] < cells[1]; ++at[1])
            for (at[2] = 0; at[2] < cells[2]; ++at[2])
                for (int p = 0; p < 6; ++p, ++tet) {
                    Eigen::Vector3i corner = at;
                    mesh.T(tet, 0) = node(corner);
                    for (int k = 0; k < 3; ++k) {
                        ++corner[paths[p][k]];
                        mesh.T(tet, k + 1) = node(corner);
                    }
                    if (!turns_left[p]) std::swap(mesh.T(tet, 2), mesh.T(tet, 3));
                }
    return mesh;
}

TetMesh cube(const PhysicsCase& c, int cells) {
    return brick(Eigen::Vector3d::Constant(c.size), Eigen::Vector3i::Constant(cells));
}

Material plain_material(const PhysicsCase& c) { return {.young = c.young, .rayleigh_mass = 0}; }

Material undamped_material(const PhysicsCase& c) {
    Material material = plain_material(c);
    material.rayleigh_stiffness = 0;
    return material;
}

Solid::Solid(TetMesh mesh, const Material& material) : body(make_body("solid", std::move(mesh), material)) {
    elastic = std::make_shared<const ElasticBody>(body);
    CollisionTree hanging = make_exact_tree(body.surface.X.cast<float>(), body.surface.F);
    hang_on_body(hanging, body, body.name);
    tree = std::make_shared<const CollisionTree>(std::move(hanging));
}

WorldBody Solid::at(const Eigen::Vector3d& centre, const Eigen::Vector3d& velocity,
                    const Eigen::Vector3d& spin, const Eigen::Matrix3d& R) const {
    WorldBody placed{
        .elastic = elastic, .W = body.W, .F = body.surface.F, .tree = tree, .bounds = BoundKind::automatic};
    const Nodes turned = body.tets.X * R.transpose();
    placed.state = {turned.rowwise() + centre.transpose(), Nodes(turned.rows(), 3)};
    for (Eigen::Index i = 0; i < turned.rows(); ++i)
        placed.state.v.row(i) = velocity + spin.cross(Eigen::Vector3d(turned.row(i)));
    return placed;
}

WorldBody alone(const std::shared_ptr<const ElasticBody>& elastic) {
    const Body body = make_body("alone", elastic->rest(), elastic->material());
    return {.elastic = elastic, .W = body.W, .F = body.surface.F};
}

WorldConfig config_of(const PhysicsCase& c) {
    WorldConfig config{.gravity = {0, 0, -standard_gravity}};
    config.contact.intersection_free = c.intersection_free;
    return config;
}

void add_far_body(World& world, const PhysicsCase& c) {
    if (!c.far_body) return;
    PhysicsCase large = c;
    large.size *= 100;
    const int body = world.add_body(
        Solid(cube(large, 1), plain_material(large)).at({large.size, 0, large.size + 50}, {100, 0, 0}));
    world.forces(body).col(2) = standard_gravity * world.elastic(body).node_masses();
}

double speed_of_sound(const PhysicsCase& c) { return std::sqrt(c.young / plain_material(c).density); }

Obstacle floor_plane(double friction, double height) {
    return {.shape = PlaneShape{.point = {0, 0, height}, .normal = Eigen::Vector3d::UnitZ()},
            .friction = friction};
}

WorldReport advance(World& world, double dt) {
    WorldReport report = world.step(dt);
    if (!report.failure.empty()) throw std::runtime_error(report.failure);
    return report;
}

Eigen::Vector3d mass_centre(const World& world, int body) {
    return centre_of_mass(world.elastic(body), world.state(body).x);
}

Eigen::Vector3d momentum(const World& world, int body) {
    return momentum_of(world.elastic(body), world.state(body)).linear;
}

Eigen::Vector3d angular_momentum(const World& world, int body) {
    const Momentum own = momentum_of(world.elastic(body), world.state(body));
    return own.angular + mass_centre(world, body).cross(own.linear);
}

Eigen::Vector3d contact_force(const World& world, int body) {
    return world.contact_forces(body).colwise().sum();
}

}  // namespace nbd
