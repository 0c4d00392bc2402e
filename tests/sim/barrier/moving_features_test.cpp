#include "sim/barrier/moving_features.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace nbd {
namespace {

/// Features of this size, at most as far from each other and from their begin, all of it near `origin`.
MovingFeatures random_features(FeatureKind kind, double size, double origin, std::mt19937_64& random) {
    std::uniform_real_distribution<double> number(-size, size);
    const auto vector = [&] { return Eigen::Vector3d(number(random), number(random), number(random)); };
    MovingFeatures features{.kind = kind, .begin = {}, .end = {}};
    const Eigen::Vector3d apart = vector();
    for (std::size_t k = 0; k < 4; ++k) {
        features.begin[k] = Eigen::Vector3d::Constant(origin) + 0.3 * vector();
        if (k >= corners_of_a(kind)) features.begin[k] += apart;
        features.end[k] = features.begin[k] + 0.5 * vector();
    }
    return features;
}

double least_distance(const MovingFeatures& features) {
    constexpr int times = 64;
    double least = std::numeric_limits<double>::infinity();
    for (int t = 0; t <= times; ++t) {
        std::array<Eigen::Vector3d, 4> x;
        for (std::size_t k = 0; k < 4; ++k)
            x[k] = features.begin[k] + t / static_cast<double>(times) * (features.end[k] - features.begin[k]);
        least = std::min(least, closest_points(features.kind, x).distance);
    }
    return least;
}

double gap_along_line(const MovingFeatures& features) {
    return features.gap_along_line(closest_points(features.kind, features.begin));
}

MovingFeatures moved_along(MovingFeatures features, const Eigen::Vector3d& by) {
    for (Eigen::Vector3d& end : features.end) end += by;
    return features;
}

TEST(MovingFeatures, AreNeverNearerThanTheirGaps) {
    std::mt19937_64 random(1);
    for (const double size : {1e-3, 1.0, 1e3})
        for (const double origin : {0.0, 1e6}) {
            const double rounding = 1e-15 * (size + origin) * 8;
            int near = 0, far = 0;
            for (int i = 0; i < 400; ++i) {
                const auto kind = i % 2 == 0 ? FeatureKind::vertex_face : FeatureKind::edge_edge;
                const MovingFeatures features = random_features(kind, size, origin, random);
                const double least = least_distance(features), along_line = gap_along_line(features);
                EXPECT_LE(features.axis_gaps().in_motion, least + rounding);
                EXPECT_LE(features.axis_gaps().at_begin,
                          closest_points(kind, features.begin).distance + rounding);
                EXPECT_LE(along_line, least + rounding);
                EXPECT_LE(features.gap_by_approach(), along_line + rounding);
                EXPECT_TRUE(features.may_press(least + 2 * rounding));
                ++(features.may_press(0.25 * least - rounding) ? near : far);
            }
            EXPECT_GT(far, 2 * near) << size;  // the bounds are tight enough to be of use
        }
}

/// A fast motion in common brings nothing nearer, nor does one along the surfaces.
TEST(MovingFeatures, DoNotComeNearerByAMotionInCommon) {
    std::mt19937_64 random(2);
    for (int i = 0; i < 200; ++i) {
        const auto kind = i % 2 == 0 ? FeatureKind::vertex_face : FeatureKind::edge_edge;
        const MovingFeatures features = random_features(kind, 0.01, 0, random),
                             carried = moved_along(features, {80, -60, 5});
        EXPECT_NEAR(carried.axis_gaps().in_motion, features.axis_gaps().in_motion, 1e-12);
        EXPECT_NEAR(gap_along_line(carried), gap_along_line(features), 1e-12);
        EXPECT_NEAR(carried.relative_motion(), features.relative_motion(), 1e-12);
    }
    MovingFeatures sliding{.kind = FeatureKind::vertex_face, .begin = {}, .end = {}};
    sliding.begin = {Eigen::Vector3d(0.2, 0.2, 0.1), Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0),
                     Eigen::Vector3d(0, 1, 0)};
    sliding.end = sliding.begin;
    sliding.end[0] += Eigen::Vector3d(0.3, 0.1, 0.02);
    EXPECT_DOUBLE_EQ(gap_along_line(sliding), 0.1);
    EXPECT_LT(sliding.gap_by_approach(), -0.2);
}

}  // namespace
}  // namespace nbd
