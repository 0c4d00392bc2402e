#include "apps/bench/physics/physics_bar.hpp"

#include "apps/bench/physics/physics_shapes.hpp"
#include "apps/bench/physics/physics_world.hpp"

namespace nbd {

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
