// The bounds by which bodies cull each other in steps.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "sim/world/world.hpp"
#include "tests/sim/world/box_model.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::Model;
using Kinds = std::array<BoundKind, 2>;

/// A box whose surface is finer than its tetrahedra, so that most vertices hang on several nodes.
Model fine_box() { return Model(test::fine_box_body({1, 0.4, 0.3}, {6, 3, 2}, 2, {.young = 5e4}), true); }

World two_boxes(const Model& box, const Kinds& kinds, const Eigen::Vector3d& origin) {
    World world(WorldConfig{});
    world.add_obstacle(test::floor_at(origin.z()));
    WorldBody bodies[] = {box.at(origin + Eigen::Vector3d(0, 0, 0.16)),
                          box.at(origin + Eigen::Vector3d(0.05, 0.03, 0.6), test::turned(0.4))};
    for (std::size_t b = 0; b < 2; ++b) {
        bodies[b].bounds = kinds[b];
        world.add_body(std::move(bodies[b]));
    }
    return world;
}

/// What happened in a world: the face pairs that were near and somewhat nearer, with their steps, the
/// contacts, and where the bodies are.
struct Story {
    using Pairs = std::vector<std::pair<int, FacePair>>;
    Pairs near, nearer;
    std::vector<int> contacts;
    Nodes a, b;
    bool operator==(const Story&) const = default;
};

Story run(World& world, int steps) {
    Story story;
    for (int i = 0; i < steps; ++i) {
        const WorldReport report = world.step(5e-3);
        EXPECT_EQ(report.failure, "");
        story.contacts.push_back(report.contacts);
        for (const FacePair& pair : world.within(0, 1, world.thickness())) story.near.emplace_back(i, pair);
        for (const FacePair& pair : world.within(0, 1, 0.999 * world.thickness()))
            story.nearer.emplace_back(i, pair);
    }
    story.a = world.state(0).x;
    story.b = world.state(1).x;
    return story;
}

TEST(Bounds, OfAllExactKindsGiveTheSameContactsBitForBit) {
    const Model box = fine_box();
    ASSERT_GT(box.tree->affine->rounding(), 0);
    // Far away, coordinates in single precision are off by up to 1 mm, as much as the contact's thickness.
    for (const Eigen::Vector3d& origin : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(20000, -15000, 3000)}) {
        World exact = two_boxes(box, {BoundKind::exact, BoundKind::exact}, origin);
        const Story expected = run(exact, 60);
        EXPECT_GT(std::ranges::count_if(expected.contacts, [](int n) { return n > 4; }), 10);
        for (const Kinds& kinds :
             {Kinds{BoundKind::affine, BoundKind::affine}, Kinds{BoundKind::affine, BoundKind::exact},
              Kinds{BoundKind::boxes, BoundKind::affine}, Kinds{BoundKind::automatic, BoundKind::boxes}}) {
            World world = two_boxes(box, kinds, origin);
            const Story story = run(world, 60);
            EXPECT_EQ(story.contacts, expected.contacts);
            EXPECT_TRUE(story.a == expected.a && story.b == expected.b);
            if (origin.norm() == 0) {
                // Trees over nodes round positions otherwise than those over vertices do.
                EXPECT_GT(expected.nearer.size(), 20u);
                EXPECT_TRUE(std::ranges::includes(story.near, expected.nearer));
                EXPECT_TRUE(std::ranges::includes(expected.near, story.nearer));
            }
        }
    }
}

TEST(Bounds, ContinuesFromASnapshotWithTheSameBits) {
    const Model box = fine_box();
    const Kinds kinds{BoundKind::affine, BoundKind::affine};
    World whole = two_boxes(box, kinds, {0, 0, 0});
    run(whole, 30);
    const WorldSnapshot middle = whole.snapshot();
    const Story rest = run(whole, 20);
    EXPECT_GT(rest.contacts.back(), 0);
    World again = two_boxes(box, kinds, {0, 0, 0});
    again.restore(middle);
    EXPECT_TRUE(run(again, 20) == rest);
    whole.restore(middle);
    EXPECT_TRUE(run(whole, 20) == rest);
}

TEST(Bounds, RefusesATreeThatHangsOtherwise) {
    const Model box = fine_box();
    World world(WorldConfig{});
    WorldBody body = box.at({0, 0, 1});
    body.bounds = BoundKind::affine;
    CollisionTree other = *box.tree;
    SurfaceEmbedding W = box.body.W.cast<float>();
    W.row(3) = W.row(4);
    hang_on_nodes(other, W, box.body.tets.X.cast<float>());
    body.tree = std::make_shared<const CollisionTree>(other);
    EXPECT_EQ(test::refusal([&] { world.add_body(body); }),
              "world: the affine bounds of a collision tree have other weights than the body");
    other.affine.reset();
    body.tree = std::make_shared<const CollisionTree>(other);
    EXPECT_NE(test::refusal([&] { world.add_body(body); }).find("no model for \"affine\" bounds"),
              std::string::npos);
    body.tree = box.tree;
    EXPECT_EQ(test::refusal([&] { world.add_body(body); }), "");
}

}  // namespace
}  // namespace nbd
