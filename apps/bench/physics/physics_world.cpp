#include "apps/bench/physics/physics_world.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "apps/cli/fill_surface.hpp"
#include "meshing/body/make_body.hpp"
#include "meshing/remesh/remesh.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "meshing/tets/tetrahedralize.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/world/hang_on_body.hpp"

namespace nbd {
namespace {

/// An icosahedron of unit radius with faces split into four.
TriMesh icosphere(int level) {
    const double t = (1 + std::sqrt(5.0)) / 2;
    std::vector<Eigen::RowVector3d> X{{-1, t, 0}, {1, t, 0}, {-1, -t, 0}, {1, -t, 0},
                                      {0, -1, t}, {0, 1, t}, {0, -1, -t}, {0, 1, -t},
                                      {t, 0, -1}, {t, 0, 1}, {-t, 0, -1}, {-t, 0, 1}};
    for (auto& x : X) x.normalize();
    std::vector<Eigen::RowVector3i> F{{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                      {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                      {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                      {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    for (int l = 0; l < level; ++l) {
        std::map<std::pair<int, int>, int> middle;
        const auto between = [&](int a, int b) {
            const auto [at, is_new] = middle.emplace(std::minmax(a, b), X.size());
            if (is_new) X.push_back((X[a] + X[b]).normalized());
            return at->second;
        };
        std::vector<Eigen::RowVector3i> finer;
        for (const auto& f : F) {
            const int a = between(f[0], f[1]), b = between(f[1], f[2]), c = between(f[2], f[0]);
            finer.insert(finer.end(), {{f[0], a, c}, {f[1], b, a}, {f[2], c, b}, {a, b, c}});
        }
        F = std::move(finer);
    }
    TriMesh mesh{Nodes(X.size(), 3), Faces(F.size(), 3)};
    for (std::size_t i = 0; i < X.size(); ++i) mesh.X.row(i) = X[i];
    for (std::size_t f = 0; f < F.size(); ++f) mesh.F.row(f) = F[f];
    return mesh;
}

}  // namespace

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

Solid::Solid(TetMesh mesh, const Material& material) : Solid(make_body("solid", std::move(mesh), material)) {}

Solid::Solid(Body of) : body(std::move(of)), elastic(std::make_shared<const ElasticBody>(body)) {
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

Solid rigid_box(const Eigen::Vector3d& size, double density) {
    return Solid(make_rigid_body("box", box_surface(size, {2, 2, 2}), density));
}

WorldBody alone(const std::shared_ptr<const ElasticBody>& elastic) {
    const Body body = make_body("alone", elastic->rest(), elastic->material());
    return {.elastic = elastic, .W = body.W, .F = body.surface.F};
}

WorldConfig config_of() { return {.gravity = {0, 0, -standard_gravity}}; }

WorldConfig weightless() {
    WorldConfig config = config_of();
    config.gravity.setZero();
    return config;
}

World world_of(const PhysicsCase& c, const WorldConfig& config, std::vector<WorldBody> bodies,
               const std::vector<Obstacle>& obstacles) {
    World world(config);
    for (WorldBody& body : bodies) world.add_body(std::move(body));
    for (const Obstacle& obstacle : obstacles) world.add_obstacle(obstacle);
    if (!c.far_body) return world;
    PhysicsCase large = c;
    large.size *= 100;
    const int far = world.add_body(
        Solid(cube(large, 1), plain_material(large)).at({large.size, 0, large.size + 50}, {100, 0, 0}));
    world.forces(far).col(2) = standard_gravity * world.elastic(far).node_masses();
    return world;
}

double speed_of_sound(const PhysicsCase& c) { return std::sqrt(c.young / plain_material(c).density); }

Obstacle floor_plane(double friction, double height) {
    return {.shape = PlaneShape{.point = {0, 0, height}, .normal = Eigen::Vector3d::UnitZ()},
            .friction = friction};
}

void advance(World& world, double dt, int steps) {
    for (int s = 0; s < steps; ++s)
        if (const WorldReport report = world.step(dt); !report.failure.empty())
            throw std::runtime_error(report.failure);
}

double energy(const World& world, int body, double gravity) {
    const ElasticBody& elastic = world.elastic(body);
    const BodyState& state = world.state(body);
    return elastic.measure(state.x).energy + kinetic_energy(elastic, state.v) +
           gravity * state.x.col(2).dot(elastic.node_masses());
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

double sliding_acceleration(const PhysicsCase& c, World& world) {
    const double mass = world.elastic(0).mass(), time = std::max(0.1, 20 * c.dt);
    const double settled = std::max(0.1, 10 * std::sqrt(1e-3 * c.size / standard_gravity));
    while (world.time() < settled) advance(world, c.dt);
    const double start = world.time(), before = momentum(world, 0).x() / mass;
    while (world.time() < start + time) advance(world, c.dt);
    return (momentum(world, 0).x() / mass - before) / (world.time() - start);
}

Eigen::Vector3d contact_force(const World& world, int body) {
    return world.contact_forces(body).colwise().sum();
}

TetMesh filled(const TriMesh& surface) {
    static std::mutex one;  // gmsh has one state for the whole program
    const std::lock_guard lock(one);
    return tetrahedralize(surface).tets;
}

TetMesh ball(double radius, int level, double poles) {
    TriMesh surface = icosphere(level);
    for (auto x : surface.X.rowwise()) {
        const double z = std::clamp(x[2], -1.0, 1.0), round = std::hypot(x[0], x[1]);
        constexpr double quarter = std::numbers::pi / 2;
        const double from_pole = quarter * std::pow(std::acos(std::abs(z)) / quarter, poles);
        const double share = round > 0 ? std::sin(from_pole) / round : 0;
        x << share * x[0], share * x[1], std::copysign(std::cos(from_pole), z);
    }
    surface.X *= radius;
    return filled(surface);
}

TriMesh box_surface(const Eigen::Vector3d& size, const Eigen::Vector3i& cells) {
    const TetMesh box = brick(size, cells);
    TriMesh surface{box.X, boundary_faces(box)};
    std::vector<int> number(box.X.rows(), -1), used;
    for (int& vertex : surface.F.reshaped()) {
        int& name = number[vertex];
        if (name < 0) {
            name = used.size();
            used.push_back(vertex);
        }
        vertex = name;
    }
    surface.X = box.X(used, Eigen::all);
    return surface;
}

double shear_coefficient(double poisson) { return 10 * (1 + poisson) / (12 + 11 * poisson); }

TetMesh bar_mesh(const PhysicsCase& c) {
    const Eigen::Vector3d size = c.size * Eigen::Vector3d(1, 0.1, 0.1);
    const bool is_cad = c.variant.find(twelve_triangles) != c.variant.npos;
    if (c.variant.find(as_meshed) != c.variant.npos) {
        MeshFileConfig config;
        config.material = undamped_material(c, c.parameter);
        Output quiet;
        quiet.quiet = true;
        const TriMesh surface =
            box_surface(size, is_cad ? Eigen::Vector3i(1, 1, 1) : Eigen::Vector3i(40, 4, 4));
        return searched("bar.obj", surface, config, usual_bending_error, quiet).body.tets;
    }
    if (!is_cad) return elements_of(c, filled(box_surface(size, {40, 4, 4})));
    const TriMesh cad = box_surface(size, {1, 1, 1});
    if (c.variant == twelve_triangles) return filled(cad);
    return elements_of(c, filled(remesh(cad, 0.05 * c.size)));
}

TetMesh elements_of(const PhysicsCase& c, TetMesh linear) {
    if (c.variant.find(quadratic_elements) == c.variant.npos) return linear;
    return make_quadratic(std::move(linear));
}

std::vector<PhysicsCase> with_quadratic(std::vector<PhysicsCase> cases) {
    const std::vector<PhysicsCase> linear = cases;
    for (PhysicsCase c : linear) {
        c.variant += (c.variant.empty() ? "" : ", ") + quadratic_elements;
        cases.push_back(std::move(c));
    }
    return cases;
}

Material undamped_material(const PhysicsCase& c, double poisson) {
    Material material = undamped_material(c);
    material.poisson = poisson;
    return material;
}

std::vector<PhysicsCase> meshed_bars(const std::string& variant, const std::vector<double>& ratios) {
    PhysicsRange range = still_range;
    range.parameters = ratios;
    range.variants = {variant};
    return all_cases(range, 1);
}

std::vector<PhysicsCase> bar_cases() {
    PhysicsRange ratios = still_range, ends = still_range;
    ratios.parameters = {0, 0.3, 0.4, 0.45, 0.49, 0.499};
    ends.sizes = {0.01, 10};
    ends.moduli = {1e4, 1e9};
    ends.parameters = {0.3};
    std::vector<PhysicsCase> bars = all_cases(ratios, 5), more = all_cases(ends, 100);
    bars.insert(bars.end(), more.begin(), more.end());
    return with_quadratic(std::move(bars));
}

}  // namespace nbd
