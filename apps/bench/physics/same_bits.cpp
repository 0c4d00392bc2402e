// The same motion on one thread and on two.
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <stdexcept>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/bench/physics/physics_world.hpp"

namespace nbd {
namespace {

/// Two cubes large enough that threads share their loops fall on each other and on a floor.
std::vector<Nodes> pile(const PhysicsCase& c, int threads) {
    std::vector<Nodes> places;
    tbb::task_arena arena(threads);
    arena.execute([&] {
        const Solid solid(cube(c, 8), plain_material(c));
        const Eigen::Matrix3d R = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
        World world = world_of(c, config_of(),
                               {solid.at({0, 0, 0.53 * c.size}, {1, 0, -1}),
                                solid.at(c.size * Eigen::Vector3d(0.2, 0.1, 1.8), {0, 0, -3}, {1, 0, 0}, R)},
                               {floor_plane(0.5)});
        advance(world, c.dt, 15);
        for (int b = 0; b < world.body_count(); ++b) places.push_back(world.state(b).x);
    });
    return places;
}

PhysicsOutcome same_bits(const PhysicsCase& c) {
    if (tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism) < 2)
        throw std::runtime_error("it needs --threads 2 or more");
    const std::vector<Nodes> one = pile(c, 1), two = pile(c, 2);
    double apart = 0;
    for (std::size_t b = 0; b < one.size(); ++b)
        apart = std::max(apart, (one[b] - two[b]).cwiseAbs().maxCoeff());
    return zero_outcome(apart);
}

}  // namespace

std::vector<PhysicsCheck> thread_checks() {
    return {{"same_bits", "Two threads give the same bits as one.", "largest difference of a place, m", 0,
             all_cases({.sizes = {0.1, 1}, .steps = {5e-3, 2e-2}, .moduli = {1e6}}, 5), same_bits}};
}

}  // namespace nbd
