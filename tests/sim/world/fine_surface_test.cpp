#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "sim/barrier/intersections.hpp"
#include "sim/fem/momentum.hpp"
#include "sim/world/world.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/on_threads.hpp"

// Surfaces much finer than their tetrahedra.
namespace nbd {
namespace {

using test::floor_at;
using test::Model;
using test::turned;

WorldConfig falling(const Eigen::Vector3d& gravity = Eigen::Vector3d::Zero()) { return {.gravity = gravity}; }

/// All intersecting faces, of surfaces that are placed vertex by vertex and looked at without a proof.
std::size_t intersections(const World& world, const std::vector<const Model*>& models) {
    std::vector<MovingSurface> surfaces;
    for (int b = 0; b < world.body_count(); ++b) {
        const Body& body = models[b]->body;
        surfaces.emplace_back(body.surface.F, embedded(body.W, body.tets.X), b);
        const Nodes x = embedded(body.W, world.state(b).x);
        surfaces.back().move(x, x);
    }
    IntersectionSearch search;
    search.begin(surfaces, 0);
    return search.find(surfaces).size();
}

TEST(FineSurfaces, MeetAsCoarseOnesDoAndKeepMomentum) {
    const Eigen::Vector3d size(0.4, 0.3, 0.3);
    const Eigen::Vector3i cells(3, 2, 2);
    const Material material{.young = 1e5, .rayleigh_mass = 0};
    const Model fine(test::fine_box_body(size, cells, 2, material)), coarse(size, cells, material);
    ASSERT_TRUE(ContactShape(fine.body.W, fine.body.surface.F, fine.body.tets.X).is_much_finer);
    const auto collide = [&](const Model& model) {
        World world(falling());
        world.add_body(model.at({0, 0, 0}, turned(0.2), {2, 0, 0}));
        world.add_body(model.at({0.55, 0.06, 0.03}, turned(-0.5), {-1, 0, 0.2}));
        const auto momentum = [&] {
            Eigen::Vector3d sum = Eigen::Vector3d::Zero();
            for (int b = 0; b < 2; ++b) sum += model.elastic->node_masses().transpose() * world.state(b).v;
            return sum;
        };
        const Eigen::Vector3d before = momentum();
        int contacts = 0;
        for (int i = 0; i < 40; ++i) {
            const WorldReport report = world.step(5e-3);
            EXPECT_EQ(report.failure, "");
            contacts += report.contacts;
            EXPECT_EQ(intersections(world, {&model, &model}), 0u) << i;
        }
        EXPECT_GT(contacts, 5);
        EXPECT_LT((momentum() - before).norm(), 1e-9 * before.norm());
        return Eigen::RowVector3d(world.state(1).v.colwise().mean());
    };
    const Eigen::RowVector3d of_fine = collide(fine), of_coarse = collide(coarse);
    EXPECT_GT(of_coarse.x(), 0.5);  // it was thrown back
    EXPECT_LT((of_fine - of_coarse).norm(), 0.15 * of_coarse.norm()) << of_fine << " for " << of_coarse;
}

TEST(FineSurfaces, MeetThemselves) {
    const Model strip(test::fine_box_body({1, 0.2, 0.04}, {16, 2, 1}, 2, {.young = 2e5}));
    WorldConfig config = falling();
    config.contact.thickness = 0.02;
    World world(config);
    world.add_body(test::strip_whose_ends_meet(strip));
    int touched = 0;
    for (int i = 0; i < 60; ++i) {
        const WorldReport report = world.step(5e-3);
        ASSERT_EQ(report.failure, "") << i;
        touched += report.contacts > 0;
        ASSERT_EQ(intersections(world, {&strip}), 0u) << i;
    }
    EXPECT_GT(touched, 2);
}

TEST(FineSurfaces, StepTheSameOnAnyNumberOfThreadsAndFromASnapshot) {
    const Model box(test::fine_box_body({0.4, 0.3, 0.3}, {3, 2, 2}, 2, {.young = 1e5}));
    const auto run = [&](bool cut) {
        const auto make = [&] {
            auto world = std::make_unique<World>(falling({0, 0, -9.81}));
            world->add_obstacle(floor_at(-0.2));
            world->add_body(box.at({0, 0, 0}, turned(0.2), {1.2, 0.1, 0}));
            world->add_body(box.at({0.5, 0.1, 0.05}, turned(-0.5), {-1.8, 0, 0.1}));
            return world;
        };
        auto world = make();
        int contacts = 0;
        for (int i = 0; i < 16; ++i) {
            if (cut && i == 9) {
                const WorldSnapshot snapshot = world->snapshot();
                world = make();
                world->restore(snapshot);
            }
            contacts += world->step(5e-3).contacts;
        }
        EXPECT_GT(contacts, 10);
        return world->state(1);
    };
    const BodyState one = test::on_threads(1, [&] { return run(false); });
    for (const BodyState& other :
         {test::on_threads(4, [&] { return run(false); }), test::on_threads(1, [&] { return run(true); })}) {
        EXPECT_TRUE(one.x == other.x);
        EXPECT_TRUE(one.v == other.v);
    }
}

}  // namespace
}  // namespace nbd
