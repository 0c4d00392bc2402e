// What holds still under a load: deflections against closed forms.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/bench/physics/physics_world.hpp"
#include "meshing/surface/quadratic_tets.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;

/// A body that holds still under small loads.
class Loaded {
 public:
    /// Nodes where `is_held` are held. is_held: of a place at rest.
    template <class Held>
    Loaded(const TetMesh& mesh, const Material& material, const Held& is_held)
        : elastic_(std::make_shared<const ElasticBody>(mesh, material)), held_(nodes_at(X(), is_held)) {}

    const Nodes& X() const { return elastic_->rest().X; }
    const Nodes& x() const { return x_; }
    const std::vector<int>& held() const { return held_; }

    /// Finds the places of the nodes: one step so long that inertia vanishes. by: of a held node's place at
    /// rest, its displacement; null: none. forces: on the nodes; empty: none.
    void rest(const std::function<Vector3d(const Vector3d&)>& by, const Nodes& forces = {},
              const Vector3d& gravity = Vector3d::Zero()) {
        WorldConfig config{.gravity = gravity};
        config.limits.stretch = std::numeric_limits<double>::infinity();
        config.linear = {.solver = LinearSolver::direct, .tolerance = 1e-9};
        config.step = {.integrator = TimeIntegrator::backward_euler, .max_substeps = 1};
        World world(config);
        WorldBody body = alone(elastic_);
        if (!by) body.grips = {{.nodes = held_}};
        for (std::size_t k = 0; by && k < held_.size(); ++k)
            body.grips.push_back(
                {.nodes = {held_[k]}, .motion = eased({.translation = by(X().row(held_[k]))})});
        world.add_body(std::move(body));
        if (forces.size() > 0) world.forces(0) = forces;
        advance(world, 1e5);
        x_ = world.state(0).x;
    }

    /// Forces of a pressure on the faces whose corners are where `is_pressed`: the same on all nodes of a
    /// face.
    template <class Pressed>
    Nodes pressed(double pressure, const Pressed& is_pressed) const {
        const TetMesh& mesh = elastic_->rest();
        Nodes forces = Nodes::Zero(X().rows(), 3);
        for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
            for (int beside = 0; beside < 4; ++beside) {
                std::vector<int> nodes;
                for (int a = 0; a < 4; ++a)
                    if (a != beside) nodes.push_back(mesh.T(t, a));
                if (!std::ranges::all_of(nodes, [&](int i) { return is_pressed(Vector3d(X().row(i))); }))
                    continue;
                const Vector3d a = X().row(nodes[0]), b = X().row(nodes[1]), c = X().row(nodes[2]),
                               inside = X().row(mesh.T(t, beside));
                Vector3d area = (b - a).cross(c - a) / 2;
                if (area.dot(inside - a) < 0) area = -area;
                for (int k = 0; k < 6 && mesh.is_quadratic(); ++k)
                    if (edges_of_tet[k].first != beside && edges_of_tet[k].second != beside)
                        nodes.push_back(mesh.E(t, k));
                for (const int node : nodes)
                    forces.row(node) += pressure / static_cast<double>(nodes.size()) * area.transpose();
            }
        return forces;
    }

    /// Elastic forces on the nodes at rest.
    Nodes forces() const {
        ElementPose pose;
        ElementForces parts;
        elastic_->pose(x_, pose, parts);
        Nodes force(x_.rows(), 3);
        elastic_->sum_forces(parts, force);
        return force;
    }

 private:
    std::shared_ptr<const ElasticBody> elastic_;
    std::vector<int> held_;
    Nodes x_{};
};

/// parameter: Poisson's ratio.
PhysicsOutcome cantilever(const PhysicsCase& c) {
    const Material material = undamped_material(c, c.parameter);
    const double L = c.size, a = 0.1 * L, g = 1e-3;  // so little that displacements are small
    Loaded bar(bar_mesh(c), material, [&](const Vector3d& p) { return p[0] < -0.499 * L; });
    bar.rest({}, {}, {0, 0, -g});
    const std::vector<int> tip = nodes_at(bar.X(), [&](const Vector3d& p) { return p[0] > 0.499 * L; });
    const double sag = (bar.X()(tip, 2) - bar.x()(tip, 2)).mean(), load = material.density * a * a * g,
                 inertia = std::pow(a, 4) / 12, shear_modulus = c.young / (2 * (1 + c.parameter));
    return relative_outcome(sag,
                            load * std::pow(L, 4) / (8 * c.young * inertia) +
                                load * L * L / (2 * shear_coefficient(c.parameter) * shear_modulus * a * a));
}

PhysicsOutcome torsion(const PhysicsCase& c) {
    const double L = c.size, a = 0.1 * L, angle = 1e-4;
    Loaded bar(bar_mesh(c), undamped_material(c, c.parameter),
               [&](const Vector3d& p) { return std::abs(p[0]) > 0.499 * L; });
    bar.rest([&](const Vector3d& p) {
        return p[0] > 0 ? Vector3d(0, -angle * p[2], angle * p[1]) : Vector3d(0, 0, 0);
    });
    const Nodes &X = bar.X(), &x = bar.x(), force = bar.forces();
    double torque = 0;
    for (const int node : bar.held())
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
    const double strain = 1e-4;
    Loaded block(elements_of(c, filled(box_surface(size, {8, 8, 4}))), undamped_material(c, c.parameter),
                 [&](const Vector3d& p) { return std::abs(p[2]) > 0.499 * size[2]; });
    block.rest([&](const Vector3d& p) { return Vector3d(0, 0, p[2] > 0 ? -strain * size[2] : 0); });
    const Nodes force = block.forces();
    double pressed = 0;
    for (const int node : block.held())
        if (block.X()(node, 2) > 0) pressed += force(node, 2);
    return relative_outcome(pressed / (c.young * size[0] * size[1] * strain), calculix_block(c.parameter));
}

/// A square plate of the case's size, a fortieth thick, of two cells across.
PhysicsOutcome plate(const PhysicsCase& c) {
    constexpr int cells = 40, across = 2;
    const double L = c.size, t = L / 40, pressure = 1e-9 * c.young;
    Loaded square(elements_of(c, brick({L, L, t}, {cells, cells, across})), undamped_material(c, c.parameter),
                  [&](const Vector3d& p) { return p.head<2>().cwiseAbs().maxCoeff() > 0.499 * L; });
    const Nodes& X = square.X();
    square.rest({}, square.pressed(pressure, [&](const Vector3d& p) { return p[2] > 0.49 * t; }));
    const double stiffness = c.young * t * t * t / (12 * (1 - c.parameter * c.parameter));
    return relative_outcome((X.col(2) - square.x().col(2)).maxCoeff(),
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
    const Solid block(cube(c, 4), jelly), slab(brick(c.size * Vector3d(1, 1, thickness), {2, 2, 1}), steel);
    WorldBody lower = block.at({0, 0, 0.5 * c.size});
    lower.grips = {
        {.nodes = nodes_at(block.body.tets.X, [&](const Vector3d& p) { return p[2] < -0.49 * c.size; })}};
    World world = world_of(c, config_of(), {lower, slab.at({0, 0, c.size * (1.002 + thickness / 2)})});
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
    const PhysicsRange jellies{.sizes = {0.1, 1},
                               .steps = steps_from_1_ms,
                               .moduli = {1e4, 1e6},
                               .far = FarBody::some,
                               .parameters = {1e2, 2e7}};
    const std::vector<PhysicsCase> bars = bar_cases();
    const auto with_meshed = [](std::vector<PhysicsCase> cases, const std::string& surface) {
        for (PhysicsCase& c : meshed_bars(surface + as_meshed, {0.3, 0.45, 0.49, 0.499, 0.4999}))
            cases.push_back(std::move(c));
        return cases;
    };
    const auto still = [](std::vector<double> ratios, std::string variant = {}) {
        PhysicsRange range = still_range;
        range.parameters = std::move(ratios);
        range.variants = {std::move(variant)};
        return range;
    };
    const char *const ratio = "Poisson's ratio", *const sag = "sag under a thousandth of m/s2, m";
    return {
        {"cantilever",
         "A cantilever of ten to one, its surface of four cells across, "
         "sags by its weight as Timoshenko's beam.",
         sag, 0.03, with_meshed(bars, ""), cantilever, ratio},
        {"cantilever_of_cad", "The same from the twelve triangles of CAD (or `told_one_across` holds).", sag,
         0.03,
         with_meshed(with_quadratic(all_cases(still({0.3}, twelve_triangles), 1)), twelve_triangles + ", "),
         cantilever, ratio},
        {"torsion", "The same bar resists torsion with 0.1406 G a^4 (Saint-Venant).",
         "torque over twist, N m2", 0.03, bars, torsion, ratio},
        {"rubber_block",
         "A block between bonded plates, half as high as wide, its surface of eight cells across, "
         "resists as CalculiX's quadratic tetrahedra say.",
         "force over modulus, area and strain", 0.02,
         with_quadratic(all_cases(still({0.3, 0.45, 0.49, 0.499}), 3)), rubber_block, ratio},
        {"plate",
         "A clamped square plate, a fortieth thick, sinks by 0.001265 p L^4 / D in its middle (Kirchhoff).",
         "sag in the middle, m", 0.03, with_quadratic(all_cases(still({0, 0.3, 0.45}), 2)), plate, ratio},
        {"slab_on_jelly",
         "Jelly under a steel slab is pressed together by m g L / (A E), and by its own weight.",
         "way down, m", 0.01, all_cases(jellies, 7, carries_itself()), slab_on_jelly, "ratio of the moduli"}};
}

}  // namespace nbd
