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

}  // namespace
}  // namespace nbd
