#include "sim/contact/self_contact.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
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

constexpr double height = 0.1;

/// A rod along x, bent at its middle into a hairpin whose arms are `gap` apart.
Nodes hairpin(const Nodes& X, double gap) {
    const double radius = (height + gap) / 2, half = std::numbers::pi / 2 * radius;
    Nodes x = X;
    for (Eigen::Index i = 0; i < X.rows(); ++i) {
        const double s = X(i, 0), side = s < 0 ? -1 : 1;
        const double angle = side * std::min(std::abs(s), half) / radius,
                     along = std::max(std::abs(s) - half, 0.0);
        const double out = radius - X(i, 2);  // from the middle of the bend
        x(i, 0) = out * std::cos(angle) - along;
        x(i, 2) = out * std::sin(angle);
    }
    return x;
}

class Hairpin : public testing::Test {
 protected:
    Hairpin() : body_(test::box_body({2, 0.1, height}, {80, 4, 4})) {
        body_.tets.X.rowwise() -= body_.tets.X.colwise().mean().eval();
        body_.surface.X.rowwise() -= body_.surface.X.colwise().mean().eval();
        tree_ = shared_exact_tree(body_.surface.X.cast<float>(), body_.surface.F);
        posed_ = std::make_unique<PosedTree>(tree_, BoundKind::boxes);
        shape_ =
            std::make_shared<const ContactShape>(body_.W, body_.surface.F, body_.tets.X, posed_->box_tree());
    }

    SelfContactFinder finder(int body) const {
        const ContactSurface surface(shape_, body_.tets.X);
        return {body,
                std::make_shared<const SelfContactRest>(surface, body_.tets.X, posed_->box_tree(), 0.01)};
    }

    /// The contacts of the arms. sides: of before; replaced.
    std::vector<Contact> find(SelfContactFinder& finder, VertexSides& sides, double gap, double speed = 0) {
        const Nodes x = hairpin(body_.tets.X, gap);
        ContactSurface surface(shape_, x);
        surface.update(x);
        const Vertices positions = embedded(body_.W, x).cast<float>();
        posed_->begin_pose(positions);
        Nodes v = Nodes::Zero(x.rows(), 3);
        v.col(2) = -speed * x.col(2).array().sign();
        std::vector<Contact> contacts;
        finder.find(surface, *posed_, v, 0.01, 1e-6, 0.01, sides, contacts);
        std::erase_if(contacts,
                      [&](const Contact& c) { return surface.x(c.a.vertices[0]).x() > -0.05; });  // the bend
        return contacts;
    }
    std::vector<Contact> find_anew(double gap, double speed = 0) {
        SelfContactFinder finder = this->finder(0);
        VertexSides sides;
        return find(finder, sides, gap, speed);
    }

    Body body_;
    std::shared_ptr<const CollisionTree> tree_;
    std::unique_ptr<PosedTree> posed_;
    std::shared_ptr<const ContactShape> shape_;
};

TEST_F(Hairpin, ArmsPressOnEachOtherWhereTheyAreNear) {
    SelfContactFinder finder = this->finder(3);
    VertexSides sides;
    const std::vector<Contact> contacts = find(finder, sides, 0.005);
    int vertices = 0;
    for (const Contact& c : contacts) {
        EXPECT_EQ(c.a.body, 3);
        EXPECT_EQ(c.b.body, 3);
        EXPECT_NEAR(c.gap, 0.005, 1e-3);
        EXPECT_GT(std::abs(c.normal.z()), 0.95);
        vertices += c.a.count == 1;
    }
    EXPECT_GT(vertices, 2 * 5 * 25);  // of the inner side of both arms
    EXPECT_TRUE(find(finder, sides, 0.03).empty());
}

TEST_F(Hairpin, ReachGrowsWithTheMotion) {
    EXPECT_TRUE(find_anew(0.015).empty());
    EXPECT_FALSE(find_anew(0.015, 0.5).empty());
}

TEST_F(Hairpin, AnArmThatCameFromTheOtherSideIsPushedBack) {
    for (const Contact& c : find_anew(-0.003)) EXPECT_GE(c.gap, 0);  // nothing is known about the sides
    SelfContactFinder finder = this->finder(0);
    VertexSides sides;
    ASSERT_FALSE(find(finder, sides, 0.003).empty());
    ASSERT_FALSE(sides.empty());
    int behind = 0;
    for (const Contact& c : find(finder, sides, -0.003)) {
        if (c.gap >= 0) continue;
        ++behind;
        EXPECT_NEAR(c.gap, -0.003, 1e-3);
    }
    EXPECT_GT(behind, 100);
}

TEST_F(Hairpin, ProofsThatFacesAreApartChangeNoContact) {
    const ContactSurface surface(shape_, body_.tets.X);
    SelfContactFinder proving = finder(0),
                      plain(0, std::make_shared<const SelfContactRest>(surface, body_.tets.X, nullptr, 0.01));
    VertexSides sides_of_proving, sides_of_plain;
    std::size_t contacts = 0;
    for (const double gap : {0.03, 0.015, 0.005, 0.001, -0.003, -0.008}) {
        const std::vector<Contact> one = find(proving, sides_of_proving, gap, 0.3),
                                   other = find(plain, sides_of_plain, gap, 0.3);
        EXPECT_LT(proving.costs().face_pairs, plain.costs().face_pairs - 1000) << gap;
        ASSERT_EQ(one.size(), other.size()) << gap;
        for (std::size_t i = 0; i < one.size(); ++i) {
            EXPECT_EQ(one[i].gap, other[i].gap);
            EXPECT_EQ(one[i].a.vertices, other[i].a.vertices);
            EXPECT_EQ(one[i].b.vertices, other[i].b.vertices);
        }
        contacts += one.size();
    }
    EXPECT_GT(contacts, 1000u);
}

/// Steps until the arms of a hairpin have met at 1 m/s. Returns the largest number of intersecting faces.
int clap(const Body& body, const std::shared_ptr<const CollisionTree>& tree, bool self_contact) {
    WorldConfig config{.gravity = Eigen::Vector3d::Zero()};
    config.contact.self_contact = self_contact;
    config.contact.thickness = 0.01;
    World world(config);
    Body bent = body;
    bent.tets.X = hairpin(body.tets.X, 0.04);
    WorldBody arms{.elastic = std::make_shared<const ElasticBody>(bent),
                   .W = body.W,
                   .F = body.surface.F,
                   .tree = tree,
                   .bounds = BoundKind::boxes};
    arms.state.x = bent.tets.X;
    arms.state.v = Nodes::Zero(bent.tets.X.rows(), 3);
    for (Eigen::Index i = 0; i < bent.tets.X.rows(); ++i)
        if (bent.tets.X(i, 0) < -0.3) arms.state.v(i, 2) = bent.tets.X(i, 2) < 0 ? 1 : -1;
    world.add_body(std::move(arms));
    std::size_t most = 0;
    for (int step = 0; step < 40; ++step) {
        EXPECT_EQ(world.step(2e-3).failure, "");
        most = std::max(most, world.intersecting_faces().size());
    }
    return most;
}

TEST_F(Hairpin, ArmsThatClapDoNotPassEachOther) {
    EXPECT_GT(clap(body_, tree_, false), 50);
    EXPECT_EQ(clap(body_, tree_, true), 0);
}

// Tests that worlds with `affine` bounds find the contacts that they find with exact bounds.

/// A box whose surface is finer than its tetrahedra, so that most vertices hang on several nodes.
Model fine_box() { return Model(test::fine_box_body({1, 0.4, 0.3}, {6, 3, 2}, 2, {.young = 5e4}), true); }

World two_boxes(const Model& box, const Kinds& kinds, const Eigen::Vector3d& origin) {
    World world(WorldConfig{});
    world.add_obstacle(test::floor_at(origin.z()));
    WorldBody bodies[] = {box.at(origin + Eigen::Vector3d(0, 0, 0.16)),
                          box.at(origin + Eigen::Vector3d(0.05, 0.03, 0.5), test::turned(0.4))};
    for (std::size_t b = 0; b < 2; ++b) {
        bodies[b].bounds = kinds[b];
        world.add_body(std::move(bodies[b]));
    }
    return world;
}

/// What happened in a world: the face pairs that touched, the contacts, and where the bodies are.
struct Story {
    std::vector<FacePair> pairs;
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
        const std::vector<FacePair> touching = world.intersecting(0, 1);
        story.pairs.insert(story.pairs.end(), touching.begin(), touching.end());
    }
    story.a = world.state(0).x;
    story.b = world.state(1).x;
    return story;
}

TEST(AffineWorld, HasTheContactsOfExactBoundsBitForBit) {
    const Model box = fine_box();
    ASSERT_GT(box.tree->affine->rounding(), 0);
    // Far away, coordinates in single precision are off by up to 1 mm, a tenth of the contact's thickness.
    for (const Eigen::Vector3d& origin : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(20000, -15000, 3000)}) {
        World exact = two_boxes(box, {BoundKind::exact, BoundKind::exact}, origin);
        const Story expected = run(exact, 60);
        EXPECT_GT(std::ranges::count_if(expected.contacts, [](int n) { return n > 20; }), 10);
        for (const Kinds& kinds :
             {Kinds{BoundKind::affine, BoundKind::affine}, Kinds{BoundKind::affine, BoundKind::exact},
              Kinds{BoundKind::boxes, BoundKind::affine}}) {
            World world = two_boxes(box, kinds, origin);
            const Story story = run(world, 60);
            EXPECT_EQ(story.contacts, expected.contacts);
            EXPECT_TRUE(story.a == expected.a && story.b == expected.b);
            if (origin.norm() == 0) {
                EXPECT_GT(expected.pairs.size(), 20u);
                EXPECT_EQ(story.pairs, expected.pairs);
            }
        }
    }
}

TEST(AffineWorld, ContinuesFromASnapshotWithTheSameBits) {
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

TEST(AffineWorld, RefusesATreeThatHangsOtherwise) {
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
