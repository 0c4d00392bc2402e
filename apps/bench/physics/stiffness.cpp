// What holds still under a load: deflections against closed forms.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/bench/physics/physics_shapes.hpp"
#include "apps/bench/physics/physics_world.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;

struct Hold {
    std::vector<int> nodes;
    Nodes by{};  // displacements; empty: none
};

/// Places of the nodes at rest under small loads: one step so long that inertia vanishes.
Nodes at_rest(const std::shared_ptr<const ElasticBody>& elastic, const Hold& hold, const Nodes& forces,
              const Vector3d& gravity = Vector3d::Zero()) {
    WorldConfig config{.gravity = gravity};
    config.limits.stretch = std::numeric_limits<double>::infinity();
    config.linear = {.solver = LinearSolver::direct, .tolerance = 1e-9};
    config.step.max_substeps = 1;
    World world(config);
    WorldBody body = alone(elastic);
    if (hold.by.size() == 0) body.grips = {{.nodes = hold.nodes}};
    for (Eigen::Index k = 0; k < hold.by.rows(); ++k)
        body.grips.push_back({.nodes = {hold.nodes[k]}, .translation = hold.by.row(k)});
    world.add_body(std::move(body));
    if (forces.size() > 0) world.forces(0) = forces;
    advance(world, 1e5);
    return world.state(0).x;
}

Nodes elastic_forces(const ElasticBody& elastic, const Nodes& x) {
    ElementPose pose;
    ElementForces parts;
    elastic.pose(x, pose, parts);
    Nodes force(x.rows(), 3);
    elastic.sum_forces(parts, force);
    return force;
}

/// parameter: Poisson's ratio.
PhysicsOutcome cantilever(const PhysicsCase& c) {
    const Material material = undamped_material(c, c.parameter);
    const auto elastic = std::make_shared<const ElasticBody>(bar_mesh(c), material);
    const Nodes& X = elastic->rest().X;
    const double L = c.size, a = 0.1 * L, g = 1e-3;  // so little that displacements are small
    const Hold hold{nodes_at(X, [&](const Vector3d& p) { return p[0] < -0.499 * L; })};
    const Nodes x = at_rest(elastic, hold, {}, {0, 0, -g});
    const std::vector<int> tip = nodes_at(X, [&](const Vector3d& p) { return p[0] > 0.499 * L; });
    const double sag = (X(tip, 2) - x(tip, 2)).mean(), load = material.density * a * a * g,
                 inertia = std::pow(a, 4) / 12, shear_modulus = c.young / (2 * (1 + c.parameter));
    return relative_outcome(sag,
                            load * std::pow(L, 4) / (8 * c.young * inertia) +
                                load * L * L / (2 * shear_coefficient(c.parameter) * shear_modulus * a * a));
}

PhysicsOutcome torsion(const PhysicsCase& c) {
    const Material material = undamped_material(c, c.parameter);
    const auto elastic = std::make_shared<const ElasticBody>(bar_mesh(c), material);
    const Nodes& X = elastic->rest().X;
    const double L = c.size, a = 0.1 * L, angle = 1e-4;
    Hold hold{nodes_at(X, [&](const Vector3d& p) { return std::abs(p[0]) > 0.499 * L; })};
    hold.by.setZero(hold.nodes.size(), 3);
    for (std::size_t k = 0; k < hold.nodes.size(); ++k) {
        const Vector3d p = X.row(hold.nodes[k]);
        if (p[0] > 0) hold.by.row(k) << 0, -angle * p[2], angle * p[1];
    }
    const Nodes x = at_rest(elastic, hold, {});
    const Nodes force = elastic_forces(*elastic, x);
    double torque = 0;
    for (const int node : hold.nodes)
        if (X(node, 0) > 0) torque -= x(node, 1) * force(node, 2) - x(node, 2) * force(node, 1);
    // The ends cannot warp: the twist is that of the middle.
    const auto turn = [&](double at) {
        double sum = 0, weight = 0;
        for (const int node :
             nodes_at(X, [&](const Vector3d& p) { return std::abs(p[0] - at) < 0.02 * L; })) {
            const Vector3d p = X.row(node), u = Vector3d(x.row(node)) - p;
            sum += p[1] * u[2] - p[2] * u[1];
            weight += p[1] * p[1] + p[2] * p[2];
        }
        return sum / weight;
    };
    const double twist = (turn(0.25 * L) - turn(-0.25 * L)) / (0.5 * L);
    return relative_outcome(torque / twist,
                            c.young / (2 * (1 + c.parameter)) * torsion_constant * std::pow(a, 4));
}

/// Force on a rubber block between plates over modulus, area and strain: by Poisson's ratio, of CalculiX's
/// quadratic tetrahedra, as apps/results/rubber_block.py prints it.
double calculix_block(double poisson) {
    constexpr std::pair<double, double> table[]{
        {0.3, 1.1359}, {0.45, 1.4419}, {0.49, 1.6146}, {0.499, 1.6636}};
    const auto* const row = std::ranges::find(table, poisson, &std::pair<double, double>::first);
    if (row == std::end(table)) throw std::logic_error("no reference for this ratio");
    return row->second;
}

/// A block as wide and deep as the case's size, half as high, bonded to both plates.
PhysicsOutcome rubber_block(const PhysicsCase& c) {
    const Vector3d size = c.size * Vector3d(1, 1, 0.5);
    const auto elastic = std::make_shared<const ElasticBody>(filled(box_surface(size, {8, 8, 4})),
                                                             undamped_material(c, c.parameter));
    const Nodes& X = elastic->rest().X;
    const double strain = 1e-4;
    Hold hold{nodes_at(X, [&](const Vector3d& p) { return std::abs(p[2]) > 0.499 * size[2]; })};
    hold.by.setZero(hold.nodes.size(), 3);
    for (std::size_t k = 0; k < hold.nodes.size(); ++k)
        if (X(hold.nodes[k], 2) > 0) hold.by(k, 2) = -strain * size[2];
    const Nodes x = at_rest(elastic, hold, {});
    const Nodes force = elastic_forces(*elastic, x);
    double pressed = 0;
    for (const int node : hold.nodes)
        if (X(node, 2) > 0) pressed += force(node, 2);
    return relative_outcome(pressed / (c.young * size[0] * size[1] * strain), calculix_block(c.parameter));
}

/// A square plate of the case's size, a fortieth thick, of two cells across.
PhysicsOutcome plate(const PhysicsCase& c) {
    constexpr int cells = 40, across = 2;
    const double L = c.size, t = L / 40, pressure = 1e-9 * c.young;
    const auto elastic = std::make_shared<const ElasticBody>(brick({L, L, t}, {cells, cells, across}),
                                                             undamped_material(c, c.parameter));
    const Nodes& X = elastic->rest().X;
    const Hold hold{
        nodes_at(X, [&](const Vector3d& p) { return p.head<2>().cwiseAbs().maxCoeff() > 0.499 * L; })};
    Nodes forces = Nodes::Zero(X.rows(), 3);
    for (const int node : nodes_at(X, [&](const Vector3d& p) { return p[2] > 0.49 * t; }))
        forces(node, 2) = -pressure * L * L / (cells * cells);
    const Nodes x = at_rest(elastic, hold, forces);
    const double stiffness = c.young * t * t * t / (12 * (1 - c.parameter * c.parameter));
    return relative_outcome((X.col(2) - x.col(2)).maxCoeff(),
                            0.00126532 * pressure * std::pow(L, 4) / stiffness);
}

/// A steel slab on jelly that cannot bulge: parameter is the ratio of their moduli.
PhysicsOutcome slab_on_jelly(const PhysicsCase& c) {
    Material jelly = plain_material(c), steel = jelly;
    jelly.poisson = steel.poisson = 0;
    // The slab presses the jelly together by a twentieth; damping is critical, so that it comes to rest soon.
    constexpr double strain = 0.05;
    const double rate = std::sqrt(standard_gravity / (strain * c.size));
    jelly.rayleigh_mass = steel.rayleigh_mass = 2 * rate;
    steel.young = c.parameter * c.young;
    steel.density = 7800;
    const double thickness = strain * c.young / (steel.density * standard_gravity * c.size);
    World world(config_of(c));
    const Solid block(cube(c, 4), jelly), slab(brick(c.size * Vector3d(1, 1, thickness), {2, 2, 1}), steel);
    WorldBody lower = block.at({0, 0, 0.5 * c.size});
    lower.grips = {
        {.nodes = nodes_at(block.body.tets.X, [&](const Vector3d& p) { return p[2] < -0.49 * c.size; })}};
    world.add_body(std::move(lower));
    world.add_body(slab.at({0, 0, c.size * (1.002 + thickness / 2)}));
    add_far_body(world, c);
    const double rest = 15 / rate;
    while (world.time() < rest) advance(world, c.dt);
    const Nodes& X = block.body.tets.X;
    const std::vector<int> top = nodes_at(X, [&](const Vector3d& p) { return p[2] > 0.49 * c.size; });
    const double sunk = c.size - world.state(0).x(top, 2).mean(),
                 weight = standard_gravity * world.elastic(1).mass();
    return relative_outcome(
        sunk,
        c.size / c.young * (weight / (c.size * c.size) + jelly.density * standard_gravity * c.size / 2));
}

}  // namespace

std::vector<PhysicsCheck> stiffness_checks() {
    std::vector<PhysicsCheck> checks;
    const std::vector<PhysicsCase> bars = bar_cases();
    const auto still = [](std::vector<double> ratios, std::string variant = {}) {
        PhysicsRange range = still_range;
        range.parameters = std::move(ratios);
        range.variants = {std::move(variant)};
        return range;
    };
    checks.push_back({.name = "cantilever",
                      .section = 4,
                      .truth = "A cantilever of ten to one, its surface of four cells across, "
                               "sags by its weight as Timoshenko's beam.",
                      .quantity = "sag under a thousandth of m/s2, m",
                      .allowed = 0.03,
                      .parameter = "Poisson's ratio",
                      .cases = bars,
                      .run = cantilever});
    checks.push_back({.name = "cantilever_of_cad",
                      .section = 4,
                      .truth = "The same from the twelve triangles of CAD (or `told_one_across` holds).",
                      .quantity = "sag under a thousandth of m/s2, m",
                      .allowed = 0.03,
                      .parameter = "Poisson's ratio",
                      .cases = all_cases(still({0.3}, twelve_triangles), 1),
                      .run = cantilever});
    checks.push_back({.name = "torsion",
                      .section = 4,
                      .truth = "The same bar resists torsion with 0.1406 G a^4 (Saint-Venant).",
                      .quantity = "torque over twist, N m2",
                      .allowed = 0.03,
                      .parameter = "Poisson's ratio",
                      .cases = bars,
                      .run = torsion});
    checks.push_back(
        {.name = "rubber_block",
         .section = 4,
         .truth = "A block between bonded plates, half as high as wide, its surface of eight cells across, "
                  "resists as CalculiX's quadratic tetrahedra say.",
         .quantity = "force over modulus, area and strain",
         .allowed = 0.02,
         .parameter = "Poisson's ratio",
         .cases = all_cases(still({0.3, 0.45, 0.49, 0.499}), 3),
         .run = rubber_block});
    checks.push_back({.name = "plate",
                      .section = 4,
                      .truth = "A clamped square plate, a fortieth thick, "
                               "sinks by 0.001265 p L^4 / D in its middle (Kirchhoff).",
                      .quantity = "sag in the middle, m",
                      .allowed = 0.03,
                      .parameter = "Poisson's ratio",
                      .cases = all_cases(still({0, 0.3, 0.45}), 2),
                      .run = plate});
    checks.push_back(
        {.name = "slab_on_jelly",
         .section = 4,
         .truth = "Jelly under a steel slab is pressed together by m g L / (A E), and by its own weight.",
         .quantity = "way down, m",
         .allowed = 0.01,
         .parameter = "ratio of the moduli",
         .cases = all_cases({.sizes = {0.1, 1},
                             .steps = steps_from_1_ms,
                             .moduli = {1e4, 1e6},
                             .far = FarBody::some,
                             .parameters = {1e2, 2e7}},
                            7, [](const PhysicsCase& c) { return carries_itself(c, 0.1); }),
         .run = slab_on_jelly});
    return checks;
}

}  // namespace nbd
