// Bodies that nothing touches: they fall, fly, hang and spin.
#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/bench/physics/physics_world.hpp"

namespace nbd {
namespace {

/// Way of n steps from rest under the acceleration a. The first, which knows none before it, goes farther by
/// an eighteenth of a dt^2.
double way_of_steps(double a, double dt, int n) { return a * dt * dt * (n * n / 2. + 1. / 18); }

PhysicsOutcome fall(const PhysicsCase& c, const Eigen::Vector3d& from, const Eigen::Vector3d& velocity) {
    constexpr int steps = 40;
    World world = world_of(c, config_of(), {Solid(cube(c), plain_material(c)).at(from, velocity)});
    const Eigen::Vector3d start = mass_centre(world, 0);
    advance(world, c.dt, steps);
    const Eigen::Vector3d way = mass_centre(world, 0) - start;
    const double fallen = way_of_steps(standard_gravity, c.dt, steps);
    const Eigen::Vector3d truth = steps * c.dt * velocity - Eigen::Vector3d(0, 0, fallen);
    return {.value = way[2], .truth = truth[2], .error = (way - truth).norm() / truth.norm()};
}

PhysicsOutcome sag(const PhysicsCase& c) {
    constexpr int steps = 60;
    const Solid solid(cube(c), plain_material(c));
    const ElasticBody& elastic = *solid.elastic;
    const std::vector<int> pinned =
        nodes_at(solid.body.tets.X, [&](const Eigen::Vector3d& p) { return p[2] > 0.49 * c.size; });
    WorldBody body = solid.at({0, 0, 0});
    body.grips = {{.nodes = pinned}};
    World world = world_of(c, config_of(), {body});
    advance(world, c.dt, steps);

    // The same steps of small displacements u, in double precision with a factorisation.
    std::vector<char> is_pinned(elastic.node_count(), 0);
    for (const int node : pinned) is_pinned[node] = 1;
    const Eigen::SparseMatrix<double> K = elastic.rest_stiffness(), M = elastic.mass_matrix();
    const double h = c.dt, beta = elastic.material().rayleigh_stiffness;
    constexpr double end = 5.0 / 9, now = 3.0 / 2 - 2 * end, before = end - 1.0 / 2;  // weights of the rule
    const Eigen::SparseMatrix<double> whole = M + end * h * (end * h + beta) * K;
    std::vector<Eigen::Triplet<double>> entries;
    for (int column = 0; column < whole.outerSize(); ++column)
        for (Eigen::SparseMatrix<double>::InnerIterator it(whole, column); it; ++it)
            if (!is_pinned[it.row() / 3] && !is_pinned[it.col() / 3])
                entries.emplace_back(it.row(), it.col(), it.value());
    for (const int node : pinned)
        for (int k = 0; k < 3; ++k) entries.emplace_back(3 * node + k, 3 * node + k, 1.0);
    Eigen::SparseMatrix<double> A(whole.rows(), whole.cols());
    A.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(A);
    Eigen::VectorXd u = Eigen::VectorXd::Zero(M.rows()), v = u, weight = u, v_before = u, force_before = u;
    for (int i = 0; i < elastic.node_count(); ++i)
        weight[3 * i + 2] = -standard_gravity * elastic.node_masses()[i];
    for (int s = 0; s < steps; ++s) {
        const Eigen::VectorXd force = -K * (u + beta * v), v_now = v;
        u += h * (now * v + before * v_before);
        Eigen::VectorXd b = M * v + h * (weight + now * force + before * force_before - end * K * u);
        for (const int node : pinned) b.segment<3>(3 * node).setZero();
        v = solver.solve(b);
        u += end * h * v;
        v_before = v_now;
        force_before = force;
    }
    const Nodes moved = world.state(0).x - solid.body.tets.X,
                expected = Eigen::Map<const Nodes>(u.data(), moved.rows(), 3);
    return {.value = moved.rowwise().norm().maxCoeff(),
            .truth = expected.rowwise().norm().maxCoeff(),
            .error = (moved - expected).rowwise().norm().maxCoeff() / expected.rowwise().norm().maxCoeff()};
}

/// parameter: damping by mass, 1/s.
PhysicsOutcome slow_down(const PhysicsCase& c) {
    constexpr int steps = 40;
    Material material = plain_material(c);
    material.rayleigh_mass = c.parameter;
    World world = world_of(c, weightless(), {Solid(cube(c), material).at({0, 0, 0}, {3, 0, 0})});
    advance(world, c.dt, steps);
    return relative_outcome(momentum(world, 0)[0] / world.elastic(0).mass(),
                            3 / std::pow(1 + c.parameter * c.dt, steps));
}

/// A bar that hangs by its upper edge swings by ten degrees: energy after ten periods of 100 steps, by
/// that at the start.
PhysicsOutcome pendulum(const PhysicsCase& c) {
    constexpr int periods = 10, steps = 100;
    constexpr double angle = 10 * std::numbers::pi / 180;
    const Solid solid(brick(c.size * Eigen::Vector3d(0.1, 0.1, 1), {2, 1, 10}), undamped_material(c));
    const ElasticBody& elastic = *solid.elastic;
    const Eigen::Vector3d hinge(0, 0, c.size / 2);
    WorldBody body = solid.at({0, 0, 0});
    body.state.x = ((solid.body.tets.X.rowwise() - hinge.transpose()) *
                    Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).matrix().transpose())
                       .rowwise() +
                   hinge.transpose();
    const std::vector<int> edge = nodes_at(solid.body.tets.X, [&](const Eigen::Vector3d& p) {
        return std::abs(p[0]) < 0.01 * c.size && p[2] > 0.499 * c.size;
    });
    body.grips = {{.nodes = edge}};
    const Nodes r = solid.body.tets.X.rowwise() - hinge.transpose();
    const double inertia = (r.col(0).cwiseAbs2() + r.col(2).cwiseAbs2()).dot(elastic.node_masses()),
                 moment = -standard_gravity * r.col(2).dot(elastic.node_masses());
    World world = world_of(c, config_of(), {body});
    const double lowest = standard_gravity * solid.body.tets.X.col(2).dot(elastic.node_masses()),
                 start = energy(world, 0, standard_gravity) - lowest,
                 dt = 2 * std::numbers::pi * std::sqrt(inertia / moment) / steps;
    double fastest = 0;
    for (int s = 0; s < periods * steps; ++s) {
        advance(world, dt);
        fastest = std::max(fastest, world.state(0).v.cwiseAbs().maxCoeff());
    }
    if (fastest < 0.5 * angle * std::sqrt(standard_gravity * c.size))
        throw std::runtime_error("the bar does not swing");
    return relative_outcome((energy(world, 0, standard_gravity) - lowest) / start, 1);
}

struct Elasticity {
    const char* name;
    MaterialLaw law;
    Tangent tangent;
};
constexpr Elasticity elasticities[]{
    {"corotated", MaterialLaw::corotated, Tangent::rotated},
    {"corotated, full tangent", MaterialLaw::corotated, Tangent::full},
    {"stable neo-Hookean", MaterialLaw::stable_neo_hookean, Tangent::rotated},
    {"St. Venant-Kirchhoff", MaterialLaw::st_venant_kirchhoff, Tangent::rotated}};

/// A tumbling brick's angular momentum after 1,000 steps, and at the start.
struct Tumble {
    Eigen::Vector3d start, end;
};

Tumble tumble(const PhysicsCase& c, double stiffness_damping) {
    constexpr int steps = 1000;
    constexpr double most_strain = 0.02;
    Material material = undamped_material(c);
    material.rayleigh_stiffness = stiffness_damping;
    WorldConfig config = weightless();
    for (const Elasticity& elasticity : elasticities)
        if (elasticity.name == c.variant) {
            material.law = elasticity.law;
            config.step.tangent = elasticity.tangent;
        }
    // Rotation at a rate w strains a bar of length L by density w^2 L^2 / (8 E) in its middle.
    const double rate = std::min(2 * std::numbers::pi / (steps * c.dt),
                                 std::sqrt(8 * most_strain * c.young / material.density) / c.size);
    const Solid solid(brick(c.size * Eigen::Vector3d(1, 0.5, 0.3), {2, 2, 2}), material);
    World world = world_of(
        c, config, {solid.at({0, 0, 0}, {0, 0, 0}, rate * Eigen::Vector3d(0.3, 0.2, 1).normalized())});
    const Eigen::Vector3d start = angular_momentum(world, 0);
    advance(world, c.dt, steps);
    return {.start = start, .end = angular_momentum(world, 0)};
}

PhysicsOutcome spin(const PhysicsCase& c) {
    const Tumble found = tumble(c, c.parameter);
    return {.value = found.end.norm() / found.start.norm(),
            .truth = 1,
            .error = (found.end - found.start).norm() / found.start.norm()};
}

PhysicsOutcome damped_spin(const PhysicsCase& c) {
    const Tumble damped = tumble(c, c.parameter), free = tumble(c, 0);
    return {.value = damped.end.norm() / damped.start.norm(),
            .truth = free.end.norm() / free.start.norm(),
            .error = (damped.end - free.end).norm() / free.start.norm()};
}

std::vector<std::string> laws() {
    std::vector<std::string> names;
    for (const Elasticity& elasticity : elasticities) names.emplace_back(elasticity.name);
    return names;
}

}  // namespace

std::vector<PhysicsCheck> free_motion_checks() {
    std::vector<PhysicsCase> pendulums =
        all_cases({.sizes = {0.1, 1, 10}, .steps = {0}, .moduli = {1e7, 1e9}}, 5, carries_itself(0.001));
    for (PhysicsCase& c : pendulums)
        c.dt = 2 * std::numbers::pi * std::sqrt(2 * c.size / (3 * standard_gravity)) / 100;
    const PhysicsRange tumbles{.sizes = three_sizes,
                               .steps = {1e-4, 5e-3, 2e-2},
                               .moduli = {1e4, 1e9},
                               .far = FarBody::some,
                               .variants = laws()};
    PhysicsRange all = tumbles, damped = tumbles;
    all.parameters = {0, 1e-3, 1e-2};
    damped.parameters = {1e-3, 1e-2};
    const char *const share = "angular momentum, share of the first", *const damping = "stiffness damping, s";
    return {
        {"free_fall", "A cube falls g dt^2 (n^2 / 2 + 1 / 18) in n steps.", "way, m", 1e-6, all_cases({}, 11),
         [](const PhysicsCase& c) {
             return fall(c, {0, 0, 0}, {0, 0, 0});
         }},
        {"throw", "A cube thrown at (12, 0, 5) m/s follows a parabola, but for what its first step adds.",
         "height gained, m", 1e-6, all_cases({}, 13),
         [](const PhysicsCase& c) {
             return fall(c, {0, 0, 0}, {12, 0, 5});
         }},
        // A step of double precision is 1e-10 m there.
        {"fall_far_from_origin", "A cube 1,000 km away from the origin falls as one at the origin.", "way, m",
         1e-5, all_cases({.steps = {5e-3, 2e-2}, .far = FarBody::some}, 7),
         [](const PhysicsCase& c) {
             return fall(c, {8e5, 6e5, 1e3}, {0, 0, 0});
         }},
        // At a strain of 0.01 small displacements stop to be exact.
        {"sag",
         "A cube that is pinned at its top sags as small displacements "
         "solve its own matrices of mass and stiffness.",
         "largest displacement after 60 steps, m", 0.01, all_cases({}, 7, carries_itself(0.01)), sag},
        {"mass_damping", "Damping by mass slows a cube to v / (1 + alpha dt)^n in n steps.", "speed, m/s",
         1e-6, all_cases({.parameters = {0.1, 5}}, 29), slow_down, "damping, 1/s"},
        {"pendulum",
         "An undamped bar that swings keeps 99 % of its energy over ten periods "
         "of 100 steps.",
         "share of energy left", 0.01, pendulums, pendulum},
        {"spin", "A tumbling brick that turns about once keeps its angular momentum over 1,000 steps.", share,
         1e-4, all_cases(all, 53), [](const PhysicsCase& c) { return spin(c); }, damping},
        {"spin_damped",
         "Damping of stiffness takes no angular momentum: "
         "a tumbling brick has as much after 1,000 steps as without damping.",
         share, 1e-4, all_cases(damped, 31), damped_spin, damping}};
}

}  // namespace nbd
