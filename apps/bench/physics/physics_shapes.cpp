#include "apps/bench/physics/physics_shapes.hpp"

#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <utility>
#include <vector>

#include "apps/bench/physics/physics_world.hpp"
#include "meshing/body/make_body.hpp"
#include "meshing/tets/tetrahedralize.hpp"

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
    if (c.variant == twelve_triangles) return filled(box_surface(size, {1, 1, 1}));
    return filled(box_surface(size, {40, 4, 4}));
}

Material undamped_material(const PhysicsCase& c, double poisson) {
    Material material = undamped_material(c);
    material.poisson = poisson;
    return material;
}

std::vector<PhysicsCase> bar_cases() {
    PhysicsRange ratios = still_range, ends = still_range;
    ratios.parameters = {0, 0.3, 0.4, 0.45, 0.49, 0.499};
    ends.sizes = {0.01, 10};
    ends.moduli = {1e4, 1e9};
    ends.parameters = {0.3};
    std::vector<PhysicsCase> bars = all_cases(ratios, 5), more = all_cases(ends, 100);
    bars.insert(bars.end(), more.begin(), more.end());
    return bars;
}

}  // namespace nbd
