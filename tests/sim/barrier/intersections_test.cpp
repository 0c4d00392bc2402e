#include "sim/barrier/intersections.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/box_body.hpp"

namespace nbd {
namespace {

std::vector<Intersection> intersections_of(std::vector<MovingSurface>& surfaces) {
    IntersectionSearch search;
    search.begin(surfaces);
    return search.find(surfaces);
}

TEST(Intersections, AreNoneForBoxesApart) {
    const Body box = test::box_body({1, 1, 1}, {2, 2, 2});
    std::vector<MovingSurface> surfaces;
    for (int b = 0; b < 2; ++b) surfaces.emplace_back(box.surface.F, box.surface.X, b);
    // By far less than single precision resolves.
    const Nodes beside = box.surface.X.rowwise() + Eigen::RowVector3d(1 + 1e-12, 0, 0);
    surfaces[1].move(beside, beside);
    EXPECT_TRUE(intersections_of(surfaces).empty());
    const Nodes touching = box.surface.X.rowwise() + Eigen::RowVector3d(1, 0, 0);
    surfaces[1].move(touching, touching);
    EXPECT_FALSE(intersections_of(surfaces).empty());
}

TEST(Intersections, AreNamedByBodyAndFace) {
    const Body box = test::box_body({1, 1, 1}, {2, 2, 2});
    std::vector<MovingSurface> surfaces;
    surfaces.emplace_back(box.surface.F, box.surface.X, 0);
    surfaces.emplace_back(box.surface.F, box.surface.X, -1);
    const Nodes inside = 0.9 * box.surface.X;
    surfaces[1].move(inside, inside);
    EXPECT_TRUE(intersections_of(surfaces).empty());  // surfaces, not solids, are tested
    const Nodes across = box.surface.X.rowwise() + Eigen::RowVector3d(0.4, 0.3, 0.2);
    surfaces[1].move(across, across);
    const std::vector<Intersection> found = intersections_of(surfaces);
    ASSERT_GT(found.size(), 3u);
    const std::string text = intersection_text(found, surfaces);
    EXPECT_NE(text.find(" face pairs intersect: face "), std::string::npos) << text;
    EXPECT_NE(text.find(" of body 0 and face "), std::string::npos) << text;
    EXPECT_NE(text.find(" of obstacle mesh 0, "), std::string::npos) << text;
    EXPECT_TRUE(text.ends_with(" ...")) << text;
}

/// A vertex pulled through the far side of its own body, or through a face beside it.
TEST(Intersections, AreFoundWithinABody) {
    const Body box = test::box_body({1, 1, 1}, {3, 3, 3});
    Eigen::Index corner = 0, middle = 0;
    (box.surface.X.rowwise() - Eigen::RowVector3d(0.5, 0.5, 0.5)).rowwise().norm().minCoeff(&corner);
    (box.surface.X.rowwise() - Eigen::RowVector3d(0.17, 0.17, 0.5)).rowwise().norm().minCoeff(&middle);
    std::vector<MovingSurface> surfaces;
    surfaces.emplace_back(box.surface.F, box.surface.X, 0);
    EXPECT_TRUE(intersections_of(surfaces).empty());
    Nodes x = box.surface.X;
    x.row(middle) << 0.17, 0.17, -0.7;
    surfaces[0].move(x, x);
    EXPECT_FALSE(intersections_of(surfaces).empty());
    // A corner folded into the plane of the faces beside it: only faces with common vertices meet.
    x = box.surface.X;
    x.row(corner) << 0.1, 0.12, 0.5;
    surfaces[0].move(x, x);
    const std::vector<Intersection> folded = intersections_of(surfaces);
    ASSERT_FALSE(folded.empty());
    for (const Intersection& pair : folded) EXPECT_EQ(pair.surface_a, pair.surface_b);
}

}  // namespace
}  // namespace nbd
