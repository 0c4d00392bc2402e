// What holds still under a load, and what rings: deflections and frequencies against closed forms.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "apps/bench/physics/physics_range.hpp"
#include "apps/bench/physics/physics_shapes.hpp"
#include "apps/bench/physics/physics_world.hpp"
#include "sim/fem/modes.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;

constexpr double torsion_constant =
    0.140577;  // of a square bar by its side to the fourth [TimoshenkoGoodier70]

/// Shear coefficient of a rectangular section [Cowper66].
double shear_coefficient(double poisson) { return 10 * (1 + poisson) / (12 + 11 * poisson); }

Material material_of(const PhysicsCase& c, double poisson) {
    Material material = undamped_material(c);
    material.poisson = poisson;
    return material;
}

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
        body.grips.push_back(
            {.nodes = {hold.nodes[static_cast<std::size_t>(k)]}, .translation = hold.by.row(k)});
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

/// A bar of 1 x 0.1 x 0.1 of the case's size.
TetMesh bar_mesh(const PhysicsCase& c) {
    const Vector3d size = c.size * Vector3d(1, 0.1, 0.1);
    if (c.variant == "twelve triangles") return filled(box_surface(size, {1, 1, 1}));
    return filled(box_surface(size, {40, 4, 4}));
}

/// parameter: Poisson's ratio.
PhysicsOutcome cantilever(const PhysicsCase& c) {
    const Material material = material_of(c, c.parameter);
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
    const Material material = material_of(c, c.parameter);
    const auto elastic = std::make_shared<const ElasticBody>(bar_mesh(c), material);
    const Nodes& X = elastic->rest().X;
    const double L = c.size, a = 0.1 * L, angle = 1e-4;
    Hold hold{nodes_at(X, [&](const Vector3d& p) { return std::abs(p[0]) > 0.499 * L; })};
    hold.by.setZero(static_cast<Eigen::Index>(hold.nodes.size()), 3);
    for (std::size_t k = 0; k < hold.nodes.size(); ++k) {
        const Vector3d p = X.row(hold.nodes[k]);
        if (p[0] > 0) hold.by.row(static_cast<Eigen::Index>(k)) << 0, -angle * p[2], angle * p[1];
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
                                                             material_of(c, c.parameter));
    const Nodes& X = elastic->rest().X;
    const double strain = 1e-4;
    Hold hold{nodes_at(X, [&](const Vector3d& p) { return std::abs(p[2]) > 0.499 * size[2]; })};
    hold.by.setZero(static_cast<Eigen::Index>(hold.nodes.size()), 3);
    for (std::size_t k = 0; k < hold.nodes.size(); ++k)
        if (X(hold.nodes[k], 2) > 0) hold.by(static_cast<Eigen::Index>(k), 2) = -strain * size[2];
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
                                                             material_of(c, c.parameter));
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

/// Lowest `count` frequencies of bending of a free Timoshenko beam in one plane, Hz [Huang61].
std::vector<double> bending_frequencies(double L, double a, const Material& m, int count) {
    const double E = m.young, G = E / (2 * (1 + m.poisson)), kGA = shear_coefficient(m.poisson) * G * a * a,
                 EI = E * std::pow(a, 4) / 12, mass = m.density * a * a,
                 rotary = m.density * std::pow(a, 4) / 12;
    // w = exp(s x), with the section's angle psi = (s^2 + mass omega^2 / kGA) / s w. At both ends, moment and
    // shear force vanish: psi' = 0 and w' = psi.
    const auto determinant = [&](double omega) {
        const double w2 = omega * omega, p = mass * w2 / kGA, q = rotary * w2 / EI, half = (p + q) / 2,
                     root = std::sqrt((p - q) * (p - q) / 4 + mass * w2 / EI);
        const double grows = std::sqrt(root - half), waves = std::sqrt(root + half);
        const double up = (grows * grows + p) / grows, round = (waves * waves - p) / waves;
        Eigen::Matrix4d ends;
        int row = 0;
        for (const double x : {0.0, L}) {
            const double scale = std::exp(-grows * L), ch = std::cosh(grows * x), sh = std::sinh(grows * x),
                         cs = std::cos(waves * x), sn = std::sin(waves * x), by = x > 0 ? scale : 1;
            // Of cosh, sinh, cos and sin: psi' and w' - psi.
            ends.row(row++) << by * up * grows * ch, by * up * grows * sh, -by * round * waves * cs,
                -by * round * waves * sn;
            ends.row(row++) << by * (grows - up) * sh, by * (grows - up) * ch, -by * (waves - round) * sn,
                by * (waves - round) * cs;
        }
        return ends.determinant();
    };
    std::vector<double> found;
    const double step = 0.002 * std::numbers::pi * std::sqrt(E / m.density) / L;
    double omega = step, before = determinant(omega);
    while (static_cast<int>(found.size()) < count) {
        const double next = determinant(omega + step);
        if (before * next < 0) {
            double low = omega, high = omega + step;
            for (int k = 0; k < 60; ++k) {
                const double middle = (low + high) / 2;
                (determinant(middle) * before > 0 ? low : high) = middle;
            }
            found.push_back(low / (2 * std::numbers::pi));
        }
        omega += step;
        before = next;
    }
    return found;
}

/// parameter: Poisson's ratio.
PhysicsOutcome ringing_bar(const PhysicsCase& c) {
    constexpr int count = 10;
    const double L = c.size, a = 0.1 * L;
    const Material material = material_of(c, c.parameter);
    const ElasticBody elastic(bar_mesh(c), material);
    static std::mutex one;  // ARPACK keeps variables of a run
    const Eigen::VectorXd found = [&] {
        const std::lock_guard lock(one);
        return Eigen::VectorXd(vibration_modes(elastic, {.count = count}).basis.frequencies);
    }();
    std::vector<double> truth;
    for (const double f : bending_frequencies(L, a, material, count)) truth.insert(truth.end(), {f, f});
    const double shear = std::sqrt(material.young / (2 * (1 + material.poisson)) / material.density),
                 sound = std::sqrt(material.young / material.density);
    for (int n = 1; n <= count; ++n) {
        truth.push_back(n * shear * std::sqrt(6 * torsion_constant) / (2 * L));
        truth.push_back(n * sound / (2 * L));
    }
    std::ranges::sort(truth);
    PhysicsOutcome worst{};
    for (int k = 0; k < count; ++k) {
        const PhysicsOutcome here = relative_outcome(found[k], truth[static_cast<std::size_t>(k)]);
        if (here.error > worst.error) worst = here;
    }
    return worst;
}

/// Energy of a bar that rings lengthwise, after ten periods of 50 steps of the second-order rule.
PhysicsOutcome ringing_energy(const PhysicsCase& c) {
    constexpr int periods = 10, steps = 50;
    constexpr double strain = 1e-3;
    const Material material = material_of(c, 0);
    const auto elastic =
        std::make_shared<const ElasticBody>(brick(c.size * Vector3d(1, 0.2, 0.2), {10, 2, 2}), material);
    WorldConfig config{.gravity = Vector3d::Zero()};
    config.step.integrator = TimeIntegrator::bdf2;
    World world(config);
    WorldBody body = alone(elastic);
    const Nodes& X = elastic->rest().X;
    body.state = {X, Nodes::Zero(X.rows(), 3)};
    for (Eigen::Index i = 0; i < X.rows(); ++i)
        body.state.x(i, 0) +=
            strain * c.size / std::numbers::pi * std::sin(std::numbers::pi * X(i, 0) / c.size);
    world.add_body(std::move(body));
    add_far_body(world, c);
    const auto energy = [&] {
        return elastic->measure(world.state(0).x).energy +
               0.5 * world.state(0).v.rowwise().squaredNorm().dot(elastic->node_masses());
    };
    const double start = energy();
    double fastest = 0;
    for (int s = 0; s < periods * steps; ++s) {
        advance(world, c.dt);
        fastest = std::max(fastest, world.state(0).v.cwiseAbs().maxCoeff());
    }
    if (fastest < 0.5 * strain * speed_of_sound(c)) throw std::runtime_error("the bar does not ring");
    return relative_outcome(energy() / start, 1);
}

}  // namespace

std::vector<PhysicsCheck> stiffness_checks() {
    std::vector<PhysicsCheck> checks;
    PhysicsRange still{.sizes = {1},
                       .steps = {1e5},
                       .moduli = {1e7},
                       .modes = {false},
                       .far = {false},
                       .parameters = {0, 0.3, 0.4, 0.45, 0.49, 0.499}};
    PhysicsRange ends = still;
    ends.sizes = {0.01, 10};
    ends.moduli = {1e4, 1e9};
    ends.parameters = {0.3};
    std::vector<PhysicsCase> bars = all_cases(still, 5), more = all_cases(ends, 100);
    bars.insert(bars.end(), more.begin(), more.end());
    std::vector<PhysicsCase> rings = bars;
    for (PhysicsCase& c : rings) c.dt = 0;
    PhysicsRange periods{.sizes = {0.01, 0.1, 10}, .steps = {0}, .modes = {false}};
    std::vector<PhysicsCase> ringing = all_cases(periods, 5);
    for (PhysicsCase& c : ringing) c.dt = 2 * c.size / speed_of_sound(c) / 50;
    checks.push_back(
        {.name = "bar_frequencies",
         .section = 1,
         .truth =
             "A free bar of ten to one, its surface of four cells across, has the ten lowest frequencies "
             "of a Timoshenko beam, Saint-Venant's torsion and sound.",
         .quantity = "frequency, Hz",
         .allowed = 0.03,
         .parameter = "Poisson's ratio",
         .cases = rings,
         .run = ringing_bar});
    checks.push_back(
        {.name = "ringing_energy",
         .section = 1,
         .truth = "An undamped bar that rings lengthwise keeps 99 % of its energy over ten periods of 50 "
                  "steps of the second-order rule.",
         .quantity = "share of energy left",
         .allowed = 0.01,
         .parameter = {},
         .cases = ringing,
         .run = ringing_energy});
    checks.push_back(
        {.name = "cantilever",
         .section = 4,
         .truth = "A cantilever of ten to one, its surface of four cells across, sags by its weight as "
                  "Timoshenko's beam.",
         .quantity = "sag under a thousandth of m/s2, m",
         .allowed = 0.03,
         .parameter = "Poisson's ratio",
         .cases = bars,
         .run = cantilever});
    PhysicsRange coarse = still;
    coarse.variants = {"twelve triangles"};
    coarse.parameters = {0.3};
    checks.push_back({.name = "cantilever_of_cad",
                      .section = 4,
                      .truth = "The same from the twelve triangles of CAD (or `told_one_across` holds).",
                      .quantity = "sag under a thousandth of m/s2, m",
                      .allowed = 0.03,
                      .parameter = "Poisson's ratio",
                      .cases = all_cases(coarse, 1),
                      .run = cantilever});
    checks.push_back({.name = "torsion",
                      .section = 4,
                      .truth = "The same bar resists torsion with 0.1406 G a^4 (Saint-Venant).",
                      .quantity = "torque over twist, N m2",
                      .allowed = 0.03,
                      .parameter = "Poisson's ratio",
                      .cases = bars,
                      .run = torsion});
    PhysicsRange rubber = still;
    rubber.parameters = {0.3, 0.45, 0.49, 0.499};
    checks.push_back(
        {.name = "rubber_block",
         .section = 4,
         .truth = "A block between bonded plates, half as high as wide, its surface of eight cells across, "
                  "resists as CalculiX's quadratic tetrahedra say.",
         .quantity = "force over modulus, area and strain",
         .allowed = 0.02,
         .parameter = "Poisson's ratio",
         .cases = all_cases(rubber, 3),
         .run = rubber_block});
    still.parameters = {0, 0.3, 0.45};
    checks.push_back(
        {.name = "plate",
         .section = 4,
         .truth = "A clamped square plate, a fortieth thick, sinks by 0.001265 p L^4 / D in its middle "
                  "(Kirchhoff).",
         .quantity = "sag in the middle, m",
         .allowed = 0.03,
         .parameter = "Poisson's ratio",
         .cases = all_cases(still, 2),
         .run = plate});
    checks.push_back(
        {.name = "slab_on_jelly",
         .section = 4,
         .truth = "Jelly under a steel slab is pressed together by m g L / (A E), and by its own weight.",
         .quantity = "way down, m",
         .allowed = 0.01,
         .parameter = "ratio of the moduli",
         .cases = all_cases({.sizes = {0.1, 1},
                             .steps = {1e-3, 5e-3, 2e-2},
                             .moduli = {1e4, 1e6},
                             .far = far_in_some,
                             .parameters = {1e2, 2e7}},
                            7, [](const PhysicsCase& c) { return carries_itself(c, 0.1); }),
         .run = slab_on_jelly});
    return checks;
}

}  // namespace nbd
