#include "sim/barrier/edge_mollifier.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace nbd {
namespace {

/// Two edges at an angle, of lengths 2 and 3 at rest and a little longer now.
struct Edges {
    explicit Edges(double angle)
        : u(2.1, 0.1, 0), w(Eigen::AngleAxisd(angle, Eigen::Vector3d(0, 1, 2).normalized()) * (1.6 * u)) {}
    EdgeMollifier weight() const { return edge_mollifier(u, w, 4, 9); }
    Eigen::Vector3d u, w;
};

TEST(EdgeMollifier, VanishesWithItsGradientWhereEdgesAreParallel) {
    const EdgeMollifier parallel = Edges(0).weight();
    EXPECT_NEAR(parallel.value, 0, 1e-12);
    EXPECT_NEAR(parallel.by_u.norm() + parallel.by_w.norm(), 0, 1e-9);
    const EdgeMollifier crossed = Edges(0.1).weight();
    EXPECT_EQ(crossed.value, 1);
    EXPECT_TRUE(crossed.by_u.isZero(0) && crossed.by_w.isZero(0));
}

TEST(EdgeMollifier, DerivativesAreThoseOfItsValue) {
    int between = 0, bent = 0;
    for (double angle = -0.04; angle < 0.04; angle += 0.0007) {
        const Edges edges(angle);
        const EdgeMollifier m = edges.weight();
        between += m.value > 0.01 && m.value < 0.99;
        const double h = 1e-6;
        const auto check = [&](Eigen::Vector3d Edges::*edge, const Eigen::Vector3d& gradient,
                               double curvature) {
            const auto moved = [&](const Eigen::Vector3d& by) {
                Edges result = edges;
                result.*edge += by;
                return result.weight();
            };
            for (int k = 0; k < 3; ++k) {
                const Eigen::Vector3d by = h * Eigen::Vector3d::Unit(k);
                EXPECT_NEAR((moved(by).value - moved(-by).value) / (2 * h), gradient[k],
                            1e-5 * (1 + gradient.norm()));
            }
            if (!(curvature > 0)) return;
            ++bent;
            const Eigen::Vector3d along = gradient.normalized();
            const auto slope = [&](const EdgeMollifier& at) {
                return along.dot(edge == &Edges::u ? at.by_u : at.by_w);
            };
            EXPECT_NEAR((slope(moved(h * along)) - slope(moved(-h * along))) / (2 * h), curvature,
                        1e-4 * curvature);
        };
        check(&Edges::u, m.by_u, m.curvature_u);
        check(&Edges::w, m.by_w, m.curvature_w);
    }
    EXPECT_GT(between, 20);
    EXPECT_GT(bent, 20);
}

}  // namespace
}  // namespace nbd
