#include "collision/geometry/predicates.hpp"

#include <gtest/gtest.h>

#include <random>

namespace nbd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

TEST(Orient2d, IsPositiveForCounterClockwise) {
    EXPECT_EQ(orient2d({0, 0}, {1, 0}, {0, 1}), 1);
    EXPECT_EQ(orient2d({0, 0}, {0, 1}, {1, 0}), -1);
    EXPECT_EQ(orient2d({0, 0}, {1, 1}, {3, 3}), 0);
    EXPECT_EQ(orient2d({1, 2}, {1, 2}, {5, 7}), 0);
}

TEST(Orient3d, IsPositiveWhereTheNormalPoints) {
    const Vector3d a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
    EXPECT_EQ(orient3d(a, b, c, {5, -3, 0.1}), 1);
    EXPECT_EQ(orient3d(a, b, c, {5, -3, -0.1}), -1);
    EXPECT_EQ(orient3d(a, b, c, {5, -3, 0}), 0);
    EXPECT_EQ(orient3d(a, b, 2 * b, c), 0);
    EXPECT_EQ(orient3d(a, a, a, c), 0);
}

TEST(Orient3d, IsExactWhereRoundingWouldDecideWrongly) {
    // Points of the plane x + y + z = 1 scaled by a power of two, with one of them moved by the smallest
    // float.
    for (const double scale : {0x1p-126, 1., 0x1p100}) {
        const Vector3d a(scale, 0, 0), b(0, scale, 0), c(0, 0, scale);
        const Vector3d d(scale / 2, scale / 4, scale / 4);
        EXPECT_EQ(orient3d(a, b, c, d), 0);
        const Vector3d hair(0x1p-149, 0,
                            0);  // changes a float value in double precision only at the smallest scale
        EXPECT_EQ(orient3d(a + hair, b, c, d), scale < 1 ? -1 : 0);
    }
    const Vector3d tiny(0x1p-149, 0, 0);
    EXPECT_EQ(orient3d({0, 0, 0}, {0x1p127, 0, 0}, {0, 0x1p127, 0}, {1, 1, 0x1p-149}), 1);
    EXPECT_EQ(orient3d({0, 0, 0}, {1, 1, 0}, {0, 0, 1}, tiny), 1);
    EXPECT_EQ(orient2d({0, 0}, {0x1p127, 0x1p127}, {0x1p-149, 0}), -1);
}

/// The determinant's sign by integer arithmetic, for integer coordinates below 2^24.
__extension__ using Integer = __int128;
int integer_orient3d(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
    const auto difference = [&](const Vector3d& x, int i) { return static_cast<Integer>(x[i] - a[i]); };
    Integer sum = 0;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        sum += difference(d, i) * (difference(b, j) * difference(c, k) - difference(b, k) * difference(c, j));
    }
    return (sum > 0) - (sum < 0);
}

TEST(Orient3d, AgreesWithIntegersNearTheFilterBound) {
    std::mt19937 random(3);
    int zeros = 0, signs = 0;
    for (int round = 0; round < 100000; ++round) {
        // Half of the rounds use multiples of 64, so that d needs no rounding.
        const unsigned mask = round % 2 ? ~0u : ~63u;
        const auto coordinate = [&] { return static_cast<double>((random() >> 9) & mask) - 0x1p22; };
        const Vector3d a(coordinate(), coordinate(), coordinate()),
            b(coordinate(), coordinate(), coordinate());
        const Vector3d c(coordinate(), coordinate(), coordinate());
        // In the plane, except for rounding.
        const double u = (random() % 64) / 64., v = (random() % 64) / 64.;
        const Vector3d d = (a + u * (b - a) + v * (c - a)).array().round();
        const int expected = integer_orient3d(a, b, c, d);
        ASSERT_EQ(orient3d(a, b, c, d), expected);
        ASSERT_EQ(orient3d_exact(a, b, c, d), expected);
        ASSERT_EQ(orient3d(b, a, c, d), -expected);
        ASSERT_EQ(orient3d(d, b, c, a), -expected);
        zeros += expected == 0;
        signs += expected != 0;
    }
    EXPECT_GT(zeros, 40000);
    EXPECT_GT(signs, 40000);
}

TEST(Orient3d, IsAntisymmetricOnFloatsOfMixedScale) {
    std::mt19937 random(5);
    int zeros = 0;
    for (int round = 0; round < 50000; ++round) {
        const auto coordinate = [&] {
            return std::ldexp(float(random() >> 8) - 0x1p23f, int(random() % 200) - 120);
        };
        const auto point = [&]() -> Vector3d {
            return Vector3f(coordinate(), coordinate(), coordinate()).cast<double>();
        };
        const Vector3d a = point(), b = point();
        const bool coplanar = random() % 2;
        const Vector3d c = coplanar ? Vector3d(2 * a) : point(), d = coplanar ? Vector3d(4 * b) : point();
        const int sign = orient3d(a, b, c, d);
        ASSERT_EQ(orient3d_exact(a, b, c, d), sign);
        ASSERT_EQ(orient3d_exact(b, a, c, d), -sign);
        ASSERT_EQ(orient3d_exact(c, d, a, b), sign);
        ASSERT_EQ(orient3d_exact(d, a, b, c), -sign);
        ASSERT_TRUE(!coplanar || sign == 0);
        zeros += sign == 0;
    }
    EXPECT_GT(zeros, 20000);
    EXPECT_LT(zeros, 30000);
}

}  // namespace
}  // namespace nbd
