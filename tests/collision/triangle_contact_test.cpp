#include "collision/triangle_contact.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "collision/triangle_triangle.hpp"
#include "tests/collision/random_triangles.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

const Triangle ground{{-4, -4, 0}, {4, -4, 0}, {0, 4, 0}};  // its outside is above

double separation(const Vector3d& d, const Triangle& a, const Triangle& b) {
    const auto least = [&](const Triangle& t) {
        return std::min({d.dot(t.a.cast<double>()), d.dot(t.b.cast<double>()), d.dot(t.c.cast<double>())});
    };
    const auto most = [&](const Triangle& t) {
        return std::max({d.dot(t.a.cast<double>()), d.dot(t.b.cast<double>()), d.dot(t.c.cast<double>())});
    };
    return least(a) - most(b);
}

TEST(TriangleContact, PushesATipBackOutOfAFace) {
    // A spike's side face whose tip has come through the ground.
    const Triangle spike{{0, 0, -.25f}, {1, 1, 3}, {-1, 1, 3}};
    const TriangleContact c = triangle_contact(spike, ground);
    EXPECT_NEAR((c.normal - Vector3d(0, 0, 1)).norm(), 0, 1e-15);
    EXPECT_NEAR(c.depth, .25, 1e-15);
    EXPECT_EQ(c.at.distance, 0);
    EXPECT_NEAR(c.at.a.z(), 0, 1e-15);
    EXPECT_NEAR((c.at.a - c.at.b).norm(), 0, 1e-15);
}

TEST(TriangleContact, KeepsToTheOutsideHoweverDeep) {
    // All but its upper edge has sunk below the ground: the shorter way is down, the right one up.
    const Triangle sunk{{0, 0, -2}, {-.5f, 0, .25f}, {.5f, 0, .25f}};
    const TriangleContact c = triangle_contact(sunk, ground);
    EXPECT_NEAR((c.normal - Vector3d(0, 0, 1)).norm(), 0, 1e-15);
    EXPECT_NEAR(c.depth, 2, 1e-15);
}

TEST(TriangleContact, PushesCrossingEdgesApart) {
    // Two ridges, one along x looking up, one along y looking down, their edges crossing by 0.1.
    const Triangle lower{{-9, 0, 0}, {9, 0, 0}, {0, 1, -9}}, upper{{0, 9, -.1f}, {0, -9, -.1f}, {1, 0, 9}};
    const TriangleContact c = triangle_contact(upper, lower);
    EXPECT_NEAR((c.normal - Vector3d(0, 0, 1)).norm(), 0, 1e-12);
    EXPECT_NEAR(c.depth, .1, 1e-7);
}

TEST(TriangleContact, ReportsMinusTheDistanceApart) {
    const Triangle above{{0, 0, .5f}, {1, 0, 2}, {0, 1, 2}};
    const TriangleContact c = triangle_contact(above, ground);
    EXPECT_NEAR((c.normal - Vector3d(0, 0, 1)).norm(), 0, 1e-15);
    EXPECT_NEAR(c.depth, -.5, 1e-15);
    EXPECT_NEAR((c.at.a - Vector3d(0, 0, .5)).norm(), 0, 1e-15);
    EXPECT_NEAR((c.at.b - Vector3d(0, 0, 0)).norm(), 0, 1e-15);
}

TEST(TriangleContact, IsContinuousThroughTouching) {
    for (const float height :
         {1e-3f, 1e-7f, 1e-12f, 1e-20f, 1e-44f, 0.f, -1e-44f, -1e-20f, -1e-12f, -1e-7f, -1e-3f}) {
        const Triangle tip{{0, 0, height}, {1, 1, 3}, {-1, 1, 3}};
        const TriangleContact c = triangle_contact(tip, ground);
        EXPECT_NEAR((c.normal - Vector3d(0, 0, 1)).norm(), 0, 1e-12) << height;
        EXPECT_NEAR(c.depth, -height, 1e-15) << height;
    }
}

TEST(TriangleContact, OfCoplanarTrianglesHasNoDepth) {
    const TriangleContact c = triangle_contact({{0, 0, 0}, {0, 1, 0}, {1, 0, 0}}, ground);
    EXPECT_NEAR((c.normal - Vector3d(0, 0, 1)).norm(), 0, 1e-15);
    EXPECT_EQ(c.depth, 0);
}

TEST(TriangleContact, OfDegenerateTrianglesIsDefined) {
    const auto expect_defined = [](const Triangle& a, const Triangle& b, double depth) {
        const TriangleContact c = triangle_contact(a, b);
        EXPECT_NEAR(c.normal.norm(), 1, 1e-15);
        EXPECT_NEAR(c.depth, depth, 1e-15);
        EXPECT_TRUE(c.at.a.allFinite());
    };
    const Triangle point{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, far_point{{0, 3, 4}, {0, 3, 4}, {0, 3, 4}};
    const Triangle segment{{-1, 0, 0}, {1, 0, 0}, {0, 0, 0}}, needle{{0, 0, -1}, {0, 0, 1}, {0, 0, 2}};
    expect_defined(point, point, 0);
    expect_defined(point, far_point, -5);
    expect_defined(point, segment, 0);
    expect_defined(segment, segment, 0);
    expect_defined(segment, needle, 0);
    expect_defined(needle, ground, 1);  // its lower end is 1 below
    expect_defined(point, ground, 0);
}

class TriangleContactOfPairs : public testing::Test {
 protected:
    /// Expects what the contract says of every pair; returns how many had a depth.
    template <typename Make>
    int count_penetrating(int pairs, double size, Make&& make) {
        int penetrating = 0;
        for (int i = 0; i < pairs; ++i) {
            const auto [a, b] = make();
            const TriangleContact c = triangle_contact(a, b), back = triangle_contact(b, a);
            EXPECT_NEAR(c.normal.norm(), 1, 1e-14);
            EXPECT_NEAR(c.depth, back.depth, 1e-12 * size);
            // After moving a by depth * normal there is a plane between the two, as far as a direction that
            // is good to a millionth can tell over triangles of twice the size.
            EXPECT_NEAR(separation(c.normal, a, b), -c.depth, 4e-6 * size);
            const bool intersecting = triangles_intersect(a, b);
            EXPECT_GE(c.depth, intersecting ? -1e-14 * size : -HUGE_VAL);
            EXPECT_LE(c.depth, intersecting ? 4 * size : 0);
            penetrating += c.depth > 0;
        }
        return penetrating;
    }
    RandomTriangles random_{4};
};

TEST_F(TriangleContactOfPairs, SeparatesRandomTriangles) {
    const int n = 20000;
    const int hits = count_penetrating(n, 1, [&] {
        return std::pair{random_.triangle(), random_.triangle()};
    });
    EXPECT_GT(hits, n / 10);
    EXPECT_LT(hits, n / 2);
}

TEST_F(TriangleContactOfPairs, SeparatesDegenerateTriangles) {
    for (const int size : {1, 2, 4})
        count_penetrating(10000, size, [&] {
            return std::pair{random_.grid_triangle(size), random_.grid_triangle(size)};
        });
}

TEST_F(TriangleContactOfPairs, SeparatesNearlyTouchingTriangles) {
    const int hits = count_penetrating(20000, 1, [&] {
        const Triangle s = random_.triangle();
        return std::pair(s, random_.nearly_touching(s));
    });
    EXPECT_GT(hits, 1000);
}

}  // namespace
}  // namespace nbd
