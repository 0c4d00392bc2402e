#include "collision/query/one_shot.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "collision/base/message.hpp"
#include "tests/support/brute_force.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

using shapes::Surface;
using test::refusal;

/// Two surfaces of unlike sizes and `shift` metres along x from their common centre.
struct Pose {
    Surface a, b;
};
Pose pose(float shift, unsigned seed) {
    std::mt19937 random(seed);
    Pose pose{shapes::torus(18, 10), seed % 2 == 0 ? shapes::bar(9, 7) : shapes::sphere(10, 12, 0.4f)};
    pose.a.X = shapes::wobbled(pose.a.X, random, 0.05f);
    pose.b.X = shapes::moved(pose.b.X, shapes::random_motion(random, 0.1f));
    pose.b.X.col(0).array() += shift;
    return pose;
}

TEST(OneShot, FindsTheFacePairsThatBruteForceFinds) {
    std::size_t intersecting = 0, near = 0;
    for (unsigned seed = 0; seed < 4; ++seed)
        for (const float shift : {0.f, 0.6f, 5.f}) {
            const auto [a, b] = pose(shift, seed);
            const auto touching = intersecting_faces(a.X, a.F, b.X, b.F);
            EXPECT_EQ(touching, test::brute_force_intersecting(a.X, a.F, b.X, b.F)) << seed << ' ' << shift;
            const auto within = face_pairs_within(a.X, a.F, b.X, b.F, 0.05f);
            EXPECT_EQ(within, test::brute_force_within(a.X, a.F, b.X, b.F, 0.05f)) << seed << ' ' << shift;
            intersecting += touching.size();
            near += within.size();
        }
    EXPECT_GT(intersecting, 50u);
    EXPECT_GT(near, 2 * intersecting);
}

TEST(OneShot, FindsThePairsOfSurfacesNearZeroAlsoFarAway) {
    const Eigen::RowVector3d far(500'000, 5'400'000, 300);
    std::size_t pairs = 0;
    for (unsigned seed = 0; seed < 4; ++seed) {
        const auto [a, b] = pose(0.6f, seed);
        const Nodes xa = a.X.cast<double>(), xb = b.X.cast<double>();
        const Nodes far_a = xa.rowwise() + far, far_b = xb.rowwise() + far;
        const auto expected = intersecting_faces(a.X, a.F, b.X, b.F);
        EXPECT_EQ(intersecting_faces(xa, a.F, xb, b.F), expected);
        EXPECT_EQ(intersecting_faces(far_a, a.F, far_b, b.F), expected);
        EXPECT_EQ(face_pairs_within(far_a, a.F, far_b, b.F, 0.05f),
                  face_pairs_within(a.X, a.F, b.X, b.F, 0.05f));
        pairs += expected.size();
        Nodes apart = far_b;
        apart.col(0).array() += 9;
        const Vertices near_apart = (apart.rowwise() - far).cast<float>();
        const ClosestFaces found = closest_points(far_a, a.F, apart, b.F),
                           near = closest_points(a.X, a.F, near_apart, b.F);
        EXPECT_EQ(found.faces, near.faces);
        EXPECT_NEAR((found.points.a - near.points.a - far.transpose()).norm(), 0, 1e-6);
    }
    EXPECT_GT(pairs, 50u);
    EXPECT_NE(intersecting_faces(Vertices((pose(0.6f, 0).a.X.cast<double>().rowwise() + far).cast<float>()),
                                 pose(0.6f, 0).a.F,
                                 Vertices((pose(0.6f, 0).b.X.cast<double>().rowwise() + far).cast<float>()),
                                 pose(0.6f, 0).b.F),
              intersecting_faces(pose(0.6f, 0).a.X, pose(0.6f, 0).a.F, pose(0.6f, 0).b.X, pose(0.6f, 0).b.F))
        << "float32 can hold these surfaces there";
    const Surface a = shapes::sphere(10, 12, 0.4f);
    const Nodes x = a.X.cast<double>();
    Faces bad = a.F;
    bad(0, 0) = 1000;
    EXPECT_NE(
        refusal([&] { intersecting_faces(x, a.F, x, bad); }).find("surface b: a face refers to vertex 1000"),
        std::string::npos);
    EXPECT_EQ(refusal([&] { intersecting_faces(x, Faces(0, 3), x, a.F); }), "surface a has no faces");
}

TEST(OneShot, FindsTheClosestPointsThatBruteForceFinds) {
    int apart = 0, touching = 0;
    for (unsigned seed = 0; seed < 4; ++seed)
        for (const float shift : {0.f, 0.6f, 1.5f}) {
            const auto [a, b] = pose(shift, seed);
            const ClosestFaces found = closest_points(a.X, a.F, b.X, b.F);
            const auto expected = test::brute_force_closest(a.X, a.F, b.X, b.F);
            EXPECT_NEAR(found.points.distance, expected.distance, 1e-12);
            if (expected.distance > 0) {
                EXPECT_EQ(found.faces, expected.faces);
                EXPECT_NEAR((found.points.a - found.points.b).norm(), expected.distance, 1e-9);
            }
            ++(expected.distance > 0 ? apart : touching);
        }
    EXPECT_GE(apart, 4);
    EXPECT_GE(touching, 2);
}

TEST(OneShot, TakesPlainArraysAndPartsOfThem) {
    // Two triangles that cross, as a caller's own arrays hold them.
    const float xa[] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, xb[] = {9, 9, 9, .2f, .2f, -1, .2f, .2f, 1, .3f, .2f, 1};
    const int face[] = {0, 1, 2};
    const Eigen::Map<const Vertices> a(xa, 3, 3), b(xb, 4, 3);
    const Eigen::Map<const Faces> F(face, 1, 3);
    EXPECT_EQ(intersecting_faces(a, F, b.bottomRows(3), F), (std::vector<FacePair>{{0, 0}}));
    EXPECT_EQ(closest_points(a, F, b.bottomRows(3), F).points.distance, 0);
}

TEST(OneShot, SaysWhatIsWrongWithWhichSurface) {
    const auto [a, b] = pose(0, 2);
    Faces bad = b.F;
    bad(4, 1) = 1000;
    EXPECT_EQ(
        refusal([&] { intersecting_faces(a.X, a.F, b.X, bad); }),
        message("surface b: face 4 refers to vertex 1000, but the surface has ", b.X.rows(), " vertices"));
    bad(4, 1) = -1;
    EXPECT_NE(
        refusal([&] { closest_points(b.X, bad, a.X, a.F); }).find("surface a: face 4 refers to vertex -1"),
        std::string::npos);
    for (const float number :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        Vertices x = a.X;
        x(7, 2) = number;
        EXPECT_EQ(refusal([&] { intersecting_faces(x, a.F, b.X, b.F); }),
                  "surface a: vertex 7 is not finite");
        EXPECT_EQ(refusal([&] { closest_points(b.X, b.F, x, a.F); }), "surface b: vertex 7 is not finite");
    }
    EXPECT_EQ(refusal([&] { intersecting_faces(a.X, a.F, b.X, Faces(0, 3)); }), "surface b has no faces");
    EXPECT_EQ(refusal([&] { face_pairs_within(a.X, a.F, b.X, b.F, -1); }),
              "distance is -1 m, allowed: finite, 0 or more");
    for (const float distance :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()})
        EXPECT_NE(refusal([&] { face_pairs_within(a.X, a.F, b.X, b.F, distance); }), "");
}

}  // namespace
}  // namespace nbd
