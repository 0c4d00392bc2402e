#include "collision/geometry/box.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

TEST(Separation, SpheresThatTouchAreNeverApart) {
    std::mt19937 random(1);
    for (int i = 0; i < 100'000; ++i) {
        Sphere s{shapes::uniform3(random), 0.01f}, t{shapes::uniform3(random), 0};
        const double between = (s.c.cast<double>() - t.c.cast<double>()).norm();
        t.r = static_cast<float>(between - double{s.r});
        while (double{s.r} + double{t.r} < between) t.r = std::nextafter(t.r, infinity);
        ASSERT_FALSE(apart(s, t, 0)) << i;
        const float distance = t.r;  // the same as a distance between a sphere and a point
        ASSERT_FALSE(apart(s, {t.c, 0}, distance)) << i;
        EXPECT_TRUE(apart(s, {t.c, 0.999f * t.r}, 0)) << i;
    }
}

TEST(Separation, BoxesAtTheDistanceAreNeverApart) {
    std::mt19937 random(2);
    for (int i = 0; i < 100'000; ++i) {
        const auto point_box = [&] {
            const Eigen::Vector3f p = shapes::uniform3(random);
            return Box{{p.x(), p.y(), p.z(), 0}, {p.x(), p.y(), p.z(), 0}};
        };
        const Box s = point_box(), t = point_box();
        const double between = (s.lo.cast<double>() - t.lo.cast<double>()).matrix().norm();
        auto distance = static_cast<float>(between);
        while (double{distance} < between) distance = std::nextafter(distance, infinity);
        ASSERT_FALSE(apart(s, t, distance)) << i;
        EXPECT_TRUE(apart(s, t, 0.999f * distance)) << i;
    }
}

/// Largest distance of a point of `inner` beyond `outer`, in radii of the latter.
double out_of(const Sphere& outer, const Sphere& inner) {
    return ((outer.c.cast<double>() - inner.c.cast<double>()).norm() + double{inner.r} - double{outer.r}) /
           double{outer.r};
}

TEST(JoinedSpheres, AreTheSmallestAroundBothAtAnyScaleAndOffset) {
    std::mt19937 random(3);
    int nested = 0;
    for (int i = 0; i < 100'000; ++i) {
        const float scale = std::pow(10.f, 5 * shapes::uniform(random)),
                    offset = i % 2 == 0 ? 0.f : 1000 * scale;
        const auto sphere = [&] {
            const Eigen::Vector3f c = (scale * shapes::uniform3(random)).array() + offset;
            return Sphere{c, scale * std::abs(shapes::uniform(random))};
        };
        const Sphere s = sphere(), t = sphere(), both = joined(s, t);
        ASSERT_LE(out_of(both, s), 0) << i;
        ASSERT_LE(out_of(both, t), 0) << i;
        const double between = (s.c.cast<double>() - t.c.cast<double>()).norm(),
                     apart_by = (between + double{s.r} + double{t.r}) / 2,
                     least = std::max({apart_by, double{s.r}, double{t.r}});
        EXPECT_LE(both.r, least * (1 + 1e-6) + 2e-7 * double{offset}) << i;
        nested += apart_by < least;
    }
    EXPECT_GT(nested, 1000);
    const Sphere one{{1, 2, 3}, 0.5f};
    EXPECT_EQ(joined(one, one).c, one.c);
    EXPECT_NEAR(joined(one, one).r, one.r, 1e-6);
}

TEST(JoinedSpheres, OfNumbersThatAreNotFiniteAreNearEverything) {
    const Sphere good{{1, 2, 3}, 0.5f}, far{{1e6f, 0, 0}, 1};
    for (const float bad : {NAN, infinity})
        for (const Sphere& s : {Sphere{{bad, 0, 0}, 1}, Sphere{{0, 0, 0}, bad}, Sphere{{bad, bad, 0}, bad}})
            for (const Sphere& both : {joined(s, good), joined(good, s), joined(s, s)}) {
                EXPECT_FALSE(apart(both, far, 0));
                EXPECT_FALSE(both.c.allFinite() && std::isfinite(both.r));
            }
}

}  // namespace
}  // namespace nbd
