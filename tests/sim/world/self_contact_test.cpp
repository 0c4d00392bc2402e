#include "sim/contact/self_contact.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "sim/world/world.hpp"
#include "tests/support/box_body.hpp"

namespace nbd {
namespace {

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
        shape_ = std::make_shared<const ContactShape>(body_.W, body_.surface.F, body_.tets.X);
    }

    /// The contacts of the arms.
    std::vector<Contact> find(SelfContactFinder& finder, double gap, double speed = 0) {
        const Nodes x = hairpin(body_.tets.X, gap);
        ContactSurface surface(shape_, x);
        surface.update(x);
        PosedTree tree(tree_, BoundKind::boxes);
        const Vertices positions = embedded(body_.W, x).cast<float>();
        tree.begin_pose(positions);
        Nodes v = Nodes::Zero(x.rows(), 3);
        v.col(2) = -speed * x.col(2).array().sign();
        std::vector<Contact> contacts;
        finder.find(surface, body_.tets.X, tree, v, 0.01, 0.01, 1e-6, 0.01, contacts);
        std::erase_if(contacts,
                      [&](const Contact& c) { return surface.x(c.a.vertices[0]).x() > -0.05; });  // the bend
        return contacts;
    }

    Body body_;
    std::shared_ptr<const CollisionTree> tree_;
    std::shared_ptr<const ContactShape> shape_;
};

TEST_F(Hairpin, ArmsPressOnEachOtherWhereTheyAreNear) {
    SelfContactFinder finder(3);
    const std::vector<Contact> contacts = find(finder, 0.005);
    int vertices = 0;
    for (const Contact& c : contacts) {
        EXPECT_EQ(c.a.body, 3);
        EXPECT_EQ(c.b.body, 3);
        EXPECT_NEAR(c.gap, 0.005, 1e-3);
        EXPECT_GT(std::abs(c.normal.z()), 0.95);
        vertices += c.a.count == 1;
    }
    EXPECT_GT(vertices, 2 * 5 * 25);  // of the inner side of both arms
    EXPECT_TRUE(find(finder, 0.03).empty());
}

TEST_F(Hairpin, ReachGrowsWithTheMotion) {
    SelfContactFinder finder(0);
    EXPECT_TRUE(find(finder, 0.015).empty());
    EXPECT_FALSE(find(finder, 0.015, 0.5).empty());
}

TEST_F(Hairpin, AnArmThatCameFromTheOtherSideIsPushedBack) {
    SelfContactFinder fresh(0), knowing(0);
    for (const Contact& c : find(fresh, -0.003)) EXPECT_GE(c.gap, 0);  // nothing is known about the sides
    const std::vector<Contact> before = find(knowing, 0.003);
    ASSERT_FALSE(before.empty());
    SelfContactFinder restored(0);
    ContactSides sides;
    knowing.save_sides(sides);
    restored.restore_sides(sides);
    for (SelfContactFinder* finder : {&knowing, &restored}) {
        int behind = 0;
        for (const Contact& c : find(*finder, -0.003)) {
            if (c.gap >= 0) continue;
            ++behind;
            EXPECT_NEAR(c.gap, -0.003, 1e-3);
        }
        EXPECT_GT(behind, 100);
    }
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
    return static_cast<int>(most);
}

TEST_F(Hairpin, ArmsThatClapDoNotPassEachOther) {
    EXPECT_GT(clap(body_, tree_, false), 50);
    EXPECT_EQ(clap(body_, tree_, true), 0);
}

}  // namespace
}  // namespace nbd
