#include "collision/geometry/triangle_triangle.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace nbd {
namespace {

using Eigen::Vector3f;

/// Checks that the answer for s and t is `expected` in both orders, with the corners of each in all six
/// orders, and with the coordinate axes permuted and mirrored.
testing::AssertionResult answer_is(bool expected, const Triangle& s, const Triangle& t) {
    const auto turned = [](const Triangle& x, int order, int axes) {
        static constexpr int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                             {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
        const std::array<Vector3f, 3> corners{x.a, x.b, x.c};
        const auto move = [&](int k) {
            const Vector3f& p = corners[orders[order][k]];
            const int* axis = orders[axes];
            return Vector3f(p[axis[0]], p[axis[1]], p[axis[2]]);
        };
        return Triangle{move(0), move(1), move(2)};
    };
    for (int axes = 0; axes < 6; ++axes)
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j) {
                const Triangle x = turned(s, i, axes), y = turned(t, j, axes);
                if (triangles_intersect(x, y) != expected || triangles_intersect(y, x) != expected)
                    return testing::AssertionFailure()
                           << "orders " << i << " and " << j << ", axes " << axes << " give the other answer";
            }
    return testing::AssertionSuccess();
}

const Triangle flat{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};

TEST(TrianglesIntersect, FindsCrossingTriangles) {
    EXPECT_TRUE(answer_is(true, flat, {{1, 1, -1}, {1, 1, 1}, {9, 9, 1}}));         // one edge pierces
    EXPECT_TRUE(answer_is(true, flat, {{1, 1, -1}, {1.5f, 1, -1}, {1, 1.5f, 1}}));  // two edges pierce
    EXPECT_TRUE(
        answer_is(true, flat, {{-5, 1, 2}, {5, 1, 2}, {0, 1, -9}}));  // the other triangle is pierced twice
    EXPECT_TRUE(answer_is(false, flat, {{5, 5, -1}, {5, 5, 1}, {9, 9, 1}}));  // beside the long edge
    EXPECT_TRUE(answer_is(false, flat, {{2.1f, 2.1f, -1}, {2.1f, 2.1f, 1}, {9, 9, 1}}));
    EXPECT_TRUE(answer_is(false, flat, {{1, 1, 1}, {2, 1, 2}, {1, 2, 3}}));  // above
    EXPECT_TRUE(answer_is(false, flat, {{-1, 9, -1}, {9, 9, -1}, {4, 3, 1}}));
}

TEST(TrianglesIntersect, FindsTouchingTrianglesInDifferentPlanes) {
    EXPECT_TRUE(answer_is(true, flat, {{1, 1, 0}, {1, 2, 1}, {2, 1, 1}}));      // vertex in face
    EXPECT_TRUE(answer_is(true, flat, {{2, 2, 0}, {1, 2, 1}, {2, 1, 1}}));      // vertex on edge
    EXPECT_TRUE(answer_is(true, flat, {{0, 0, 0}, {-1, -2, 1}, {-2, -1, 1}}));  // vertex on vertex
    EXPECT_TRUE(answer_is(true, flat, {{2, -1, 1}, {2, 1, -1}, {2, -9, -9}}));  // edge on edge, crossing
    EXPECT_TRUE(answer_is(true, flat, {{1, 0, 0}, {2, 0, 0}, {0, -1, 5}}));     // edge in edge
    EXPECT_TRUE(answer_is(true, flat, {{1, 1, 0}, {2, 1, 0}, {1, 1, 5}}));      // edge in face
    EXPECT_TRUE(answer_is(true, flat, {{-9, 1, 0}, {9, 1, 0}, {1, 1, 5}}));     // edge across face
    EXPECT_TRUE(answer_is(true, flat, {{4, 0, 0}, {0, 0, 0}, {1, 1, 5}}));      // a shared edge
    EXPECT_TRUE(answer_is(true, flat, {{-1, -1, -1}, {0, 0, 0}, {3, 3, 3}}));   // corner of `flat` on an edge
    EXPECT_TRUE(answer_is(true, flat, {{-3, -3, -1}, {0, 0, 0}, {-3, -3, 3}}));
    EXPECT_TRUE(
        answer_is(true, flat, {{-1, 1, 1}, {-1, -1, 1}, {1, 0, -1}}));  // edge through an edge of the face
    EXPECT_TRUE(answer_is(false, flat, {{-1, 0, 0}, {-2, 0, 0}, {0, 0, 5}}));  // collinear with an edge
    EXPECT_TRUE(answer_is(false, flat, {{5, 0, 0}, {6, 1, 3}, {6, 0, -3}}));
}

TEST(TrianglesIntersect, HandlesCoplanarTriangles) {
    EXPECT_TRUE(answer_is(true, flat, flat));
    EXPECT_TRUE(answer_is(true, flat, {{1, 1, 0}, {1.5f, 1, 0}, {1, 1.5f, 0}}));  // inside
    EXPECT_TRUE(answer_is(true, flat, {{3, 3, 0}, {-1, 3, 0}, {3, -1, 0}}));      // six-pointed star
    EXPECT_TRUE(answer_is(true, flat, {{4, 0, 0}, {0, 4, 0}, {4, 4, 0}}));        // shared edge
    EXPECT_TRUE(answer_is(true, flat, {{3, 1, 0}, {1, 3, 0}, {4, 4, 0}}));        // edge in edge
    EXPECT_TRUE(answer_is(true, flat, {{4, 0, 0}, {5, 0, 0}, {5, 5, 0}}));        // shared vertex
    EXPECT_TRUE(answer_is(true, flat, {{2, 2, 0}, {5, 2, 0}, {5, 5, 0}}));        // vertex on edge
    EXPECT_TRUE(answer_is(false, flat, {{4.001f, 0, 0}, {5, 0, 0}, {5, 5, 0}}));
    EXPECT_TRUE(answer_is(false, flat, {{3, 1.5f, 0}, {1.5f, 3, 0}, {4, 4, 0}}));
    EXPECT_TRUE(answer_is(false, flat, {{3, 3, 0}, {3, 2, 0}, {2, 3, 0}}));  // boxes overlap
    const Triangle slanted{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    EXPECT_TRUE(answer_is(true, slanted, {{.5f, .25f, .25f}, {.25f, .5f, .25f}, {-1, 1, 1}}));
    EXPECT_TRUE(answer_is(true, slanted, {{-.25f, .25f, 1}, {.25f, -.25f, 1}, {-1, 0, 2}}));
    EXPECT_TRUE(answer_is(false, slanted, {{-.5f, .25f, 1.25f}, {0, -.25f, 1.25f}, {-1, 0, 2}}));
}

TEST(TrianglesIntersect, NeverFindsTrianglesInParallelPlanes) {
    const float above = std::numeric_limits<float>::denorm_min();
    EXPECT_TRUE(answer_is(false, flat, {{1, 1, above}, {2, 1, above}, {1, 2, above}}));
    EXPECT_TRUE(answer_is(true, flat, {{1, 1, above}, {2, 1, above}, {1, 2, -above}}));
}

TEST(TrianglesIntersect, DecidesByOneUlpAtAnyScaleAndOffset) {
    for (const float scale : {0x1p-140f, 0x1p-60f, 1.f, 0x1p40f, 0x1p120f}) {
        // The long edge of t's projection passes through (2, 2), so one ulp decides.
        const Triangle t{{0, 0, 0}, {4 * scale, 0, 0}, {0, 4 * scale, 0}};
        const float x = 2 * scale, beyond = std::nextafter(x, 9 * scale);
        const auto needle = [&](float px) {
            return Triangle{{px, x, -scale}, {px, x, scale}, {9 * scale, 9 * scale, scale}};
        };
        EXPECT_TRUE(answer_is(true, t, needle(x)));
        EXPECT_TRUE(answer_is(false, t, needle(beyond)));
    }
    for (const float offset : {1e3f, 1e6f, 0x1p23f}) {
        const Vector3f o(offset, -offset, offset);
        const Triangle t{o, o + Vector3f(4, 0, 0), o + Vector3f(0, 4, 4)};
        const Vector3f in_face = o + Vector3f(1, 1, 1);
        const float above = std::nextafter(in_face.z(), 2 * in_face.z());
        EXPECT_TRUE(answer_is(true, t, {in_face, o + Vector3f(1, 1, 9), o + Vector3f(0, 1, 9)}));
        EXPECT_TRUE(answer_is(
            false, t, {{in_face.x(), in_face.y(), above}, o + Vector3f(1, 1, 9), o + Vector3f(0, 1, 9)}));
    }
}

}  // namespace
}  // namespace nbd
