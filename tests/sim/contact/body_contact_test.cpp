#include "sim/contact/body_contact.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/box_body.hpp"

namespace nbd {
namespace {

/// A cube of 2 m with its upper side at z = 0, and a small cube that has sunk into it by `depth`.
class SunkCube : public testing::Test {
 protected:
    SunkCube()
        : ground_body_(test::box_body({2, 2, 2}, {1, 1, 1})),
          cube_body_(test::box_body({0.2, 0.2, 0.2}, {1, 1, 1})),
          ground(ground_body_.W, ground_body_.surface.F, ground_body_.tets.X),
          cube(cube_body_.W, cube_body_.surface.F, cube_body_.tets.X) {
        ground.update(ground_body_.tets.X.rowwise() - Eigen::RowVector3d(0, 0, 1));
    }

    /// Depth of the deepest vertex of the small cube in contact, metres; 0 if none is below the surface.
    double deepest(double depth, double moved) {
        cube.update(cube_body_.tets.X.rowwise() + Eigen::RowVector3d(0.3, 0.2, 0.1 - depth));
        std::vector<FacePair> all;
        for (int a = 0; a < cube.F().rows(); ++a)
            for (int b = 0; b < ground.F().rows(); ++b) all.push_back({a, b});
        std::vector<Contact> contacts;
        finder.find(cube, ground, all, {.apart = 0.01, .inside = 0.08}, moved, contacts);
        double deepest = 0;
        for (const Contact& contact : contacts)
            if (contact.a.body == 0 && contact.a.count == 1) deepest = std::max(deepest, -contact.gap);
        return deepest;
    }

    BodyContactFinder finder{0, 1};

 private:
    Body ground_body_, cube_body_;

 protected:
    ContactSurface ground, cube;
};

TEST_F(SunkCube, IsInContactAtAnyDepthWithinReachWithoutAHistory) {
    EXPECT_NEAR(deepest(0.06, std::numeric_limits<double>::infinity()), 0.06, 1e-12);
    EXPECT_NEAR(finder.deepest(), 0.06, 1e-12);
}

TEST_F(SunkCube, IsNotInContactDeeperThanItCanHaveMoved) {
    EXPECT_EQ(deepest(0.06, 0.05), 0);
    EXPECT_NEAR(deepest(0.04, 0.05), 0.04, 1e-12);
}

TEST_F(SunkCube, MaySinkDeeperStepByStep) {
    EXPECT_NEAR(deepest(0.03, 0.035), 0.03, 1e-12);
    EXPECT_NEAR(deepest(0.06, 0.035), 0.06, 1e-12) << "0.03 m deep before, moved by 0.035 m since";
    EXPECT_EQ(deepest(0.09, 0.035), 0) << "beyond reach";
    EXPECT_EQ(finder.deepest(), 0);
}

TEST_F(SunkCube, IsRecognisedAfterSavingAndRestoringSides) {
    deepest(0.03, 0.035);
    ContactSides sides;
    finder.save_sides(sides);
    ASSERT_EQ(sides.depths.size(), sides.vertices.size());
    finder = BodyContactFinder(0, 1);
    finder.restore_sides(sides);
    EXPECT_NEAR(deepest(0.06, 0.035), 0.06, 1e-12);
}

}  // namespace
}  // namespace nbd
