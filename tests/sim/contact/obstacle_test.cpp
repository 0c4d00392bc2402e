#include "sim/obstacles/obstacle.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "collision/base/counter_random.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

/// Signed distance to the box [-h, h].
double box_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& h) {
    const Eigen::Vector3d q = p.cwiseAbs() - h;
    return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
}

TEST(Obstacle, GivesDistancesToPlanesAndSpheres) {
    const Obstacle plane{.shape = PlaneShape{.point = {0, 0, 1}, .normal = Eigen::Vector3d::UnitZ()}};
    const auto above = signed_distance(plane, {3, -2, 1.5}, 0, 1);
    ASSERT_TRUE(above);
    EXPECT_DOUBLE_EQ(above->distance, 0.5);
    EXPECT_DOUBLE_EQ(signed_distance(plane, {3, -2, 0}, 0, 1)->distance, -1);
    const Obstacle ball{.shape = BallShape{.centre = {1, 0, 0}, .radius = 0.5}, .velocity = {0, 2, 0}};
    const auto beside = signed_distance(ball, {1, 1 + 3, 0}, 1.0, 10);  // the centre has moved to (1, 2, 0)
    ASSERT_TRUE(beside);
    EXPECT_NEAR(beside->distance, 1.5, 1e-12);
    EXPECT_LT((beside->normal - Eigen::Vector3d::UnitY()).norm(), 1e-12);
    EXPECT_NEAR(signed_distance(ball, {1, 2, 0}, 1.0, 10)->distance, -0.5, 1e-12);
}

TEST(Obstacle, MeshDistancesAgreeWithTheBoxThatTheMeshDescribes) {
    const Eigen::Vector3d half(0.5, 0.2, 0.15);
    const Body box = test::box_body(2 * half, {5, 2, 3});
    const Obstacle obstacle{.shape = std::make_shared<const StaticSurface>(box.surface)};
    CounterRandom random(5, 0);
    int inside = 0;
    for (int i = 0; i < 2000; ++i) {
        const Eigen::Vector3d p(random.uniform(-0.8, 0.8), random.uniform(-0.4, 0.4),
                                random.uniform(-0.3, 0.3));
        const auto hit = signed_distance(obstacle, p, 0, 10);
        ASSERT_TRUE(hit);
        ASSERT_NEAR(hit->distance, box_distance(p, half), 1e-12) << p.transpose();
        EXPECT_NEAR(hit->normal.norm(), 1, 1e-12);
        // A walk along the normal reaches the surface.
        EXPECT_NEAR(box_distance(p - hit->distance * hit->normal, half), 0, 1e-12);
        if (hit->distance < 0) ++inside;
    }
    EXPECT_GT(inside, 200);
    EXPECT_LT(inside, 1500);
    EXPECT_FALSE(signed_distance(obstacle, {5, 0, 0}, 0, 1));
}

TEST(Obstacle, RejectsInvalidMeshes) {
    const auto message = [](const TriMesh& mesh) { return test::refusal([&] { StaticSurface{mesh}; }); };
    TriMesh mesh = test::box_body({1, 1, 1}, {1, 1, 1}).surface;
    EXPECT_EQ(message(mesh), "");
    EXPECT_EQ(message({}), "static surface: it has no faces");
    TriMesh open = mesh;
    open.F.conservativeResize(open.F.rows() - 1, 3);
    EXPECT_EQ(message(open).rfind("static surface: it is open at edge ", 0), 0u) << message(open);
    TriMesh wild = mesh;
    wild.F(3, 1) = 99;
    EXPECT_EQ(message(wild), "surface: face 3 refers to vertex 99, but there are 8");
    TriMesh infinite = mesh;
    infinite.X(2, 0) = std::numeric_limits<double>::infinity();
    EXPECT_EQ(message(infinite), "static surface: a vertex is not finite");
}

}  // namespace
}  // namespace nbd
