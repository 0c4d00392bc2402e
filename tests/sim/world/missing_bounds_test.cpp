// Bounds that miss what comes near: steps end without intersections all the same.
#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "sim/world/world.hpp"
#include "tests/collision/models.hpp"
#include "tests/sim/world/box_model.hpp"

namespace nbd {
namespace {

using test::Model;

/// A tree of the box whose learned spheres are points at the middles of their nodes.
std::shared_ptr<const CollisionTree> tree_that_misses(const Model& box) {
    const shapes::Surface surface{box.body.surface.X.cast<float>(), box.body.surface.F};
    CollisionTree tree = shapes::full_tree(surface, shapes::make_modes(surface, 4, 20, 1));
    NbdModel& nbd = *tree.nbd;
    nbd.centre_map = {};
    nbd.out_scale.setZero();
    nbd.out_centre.setZero();
    for (std::size_t node = 0; node < tree.spheres.rest.size(); ++node)
        nbd.out_centre(3, static_cast<Eigen::Index>(node)) = -tree.spheres.rest[node].r;
    return std::make_shared<const CollisionTree>(std::move(tree));
}

/// Two cubes of 40 cm, the upper one falling at `speed`, `gap` metres above the lower one.
World two_cubes(BoundKind bounds, const Eigen::Vector3d& gravity, double gap, double speed) {
    const Model box({0.4, 0.4, 0.4}, {4, 4, 4}, {.young = 1e5, .rayleigh_mass = 0});
    const std::shared_ptr<const CollisionTree> tree = tree_that_misses(box);
    WorldConfig config{.gravity = gravity};
    config.contact.thickness = 0.01;
    World world(config);
    world.add_obstacle(test::floor_at(0));
    for (const bool upper : {false, true}) {
        const double height = upper ? 0.63 + gap : 0.23;
        WorldBody body = box.at({0.03 * upper, 0.02 * upper, height}, Eigen::Matrix3d::Identity(),
                                {0, 0, upper ? -speed : 0.0});
        body.tree = tree;
        body.bounds = bounds;
        world.add_body(std::move(body));
    }
    return world;
}

/// Steps, each without failure or intersections. Returns the number of parts that were solved anew.
int exact_parts(World& world, int steps) {
    int sum = 0;
    for (int i = 0; i < steps; ++i) {
        const WorldReport report = world.step(5e-3);
        EXPECT_EQ(report.failure, "") << i;
        EXPECT_TRUE(world.intersecting_faces().empty()) << i;
        if (!report.failure.empty()) break;
        sum += report.exact_parts;
    }
    return sum;
}

TEST(MissingBounds, PartsThatWouldIntersectAreSolvedAnewWithExactOnes) {
    const Eigen::Vector3d gravity(0, 0, -9.81);
    World missing = two_cubes(BoundKind::nbd, gravity, 0.1, 1),
          exact = two_cubes(BoundKind::exact, gravity, 0.1, 1);
    EXPECT_GT(exact_parts(missing, 100), 10);
    EXPECT_EQ(exact_parts(exact, 100), 0);
    for (int b = 0; b < 2; ++b)
        EXPECT_LT((missing.state(b).x - exact.state(b).x).cwiseAbs().maxCoeff(), 0.02) << b;
}

/// The upper cube flies to half a thousandth of the thickness over the lower one in the first step, where
/// nothing intersects, but no step can begin.
TEST(MissingBounds, PartsThatWouldEndTooNearForTheNextAreSolvedAnewAsWell) {
    constexpr double gap = 0.03, near = 5e-6;
    World world = two_cubes(BoundKind::nbd, Eigen::Vector3d::Zero(), gap, (gap - near) / 5e-3);
    const WorldReport first = world.step(5e-3);
    EXPECT_EQ(first.failure, "");
    EXPECT_EQ(first.exact_parts, 1);
    EXPECT_GT(world.surface(1).col(2).minCoeff() - world.surface(0).col(2).maxCoeff(), 100 * near);
    exact_parts(world, 40);
    EXPECT_GT(world.state(1).v.col(2).mean(), 0) << "it bounced";
}

}  // namespace
}  // namespace nbd
