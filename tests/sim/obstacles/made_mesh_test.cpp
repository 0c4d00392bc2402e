#include "sim/obstacles/made_mesh.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/obstacles/static_surface.hpp"

namespace nbd {
namespace {

/// Of a closed surface that looks outward.
double enclosed(const TriMesh& mesh) {
    double sum = 0;
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
        const Eigen::Vector3d a = mesh.X.row(mesh.F(f, 0)), b = mesh.X.row(mesh.F(f, 1)),
                              c = mesh.X.row(mesh.F(f, 2));
        sum += a.dot(b.cross(c)) / 6;
    }
    return sum;
}

TEST(MadeMesh, IsClosedAndHasTheVolumeOfItsShape) {
    const TriMesh box = box_mesh({1, 2, 3});
    EXPECT_NEAR(enclosed(box), 6, 1e-12);
    EXPECT_FALSE(StaticSurface(box).is_open());
    constexpr double pi = std::numbers::pi;
    for (const int segments : {3, 12, 48, 200}) {
        const double base = segments / 2.0 * std::sin(2 * pi / segments);  // of the polygon, radius 1
        const TriMesh cylinder = cylinder_mesh(2, 3, segments), capsule = capsule_mesh(2, 3, segments);
        EXPECT_NEAR(enclosed(cylinder), 3 * 4 * base, 1e-10);
        EXPECT_FALSE(StaticSurface(cylinder).is_open());
        EXPECT_FALSE(StaticSurface(capsule).is_open());
        constexpr double round = 12 * pi + 32 * pi / 3;
        EXPECT_NEAR(enclosed(capsule), round, 20 * round / (segments * segments));
        for (Eigen::Index v = 0; v < capsule.X.rows(); ++v) {
            Eigen::Vector3d p = capsule.X.row(v);
            p.z() -= std::clamp(p.z(), -1.5, 1.5);
            EXPECT_NEAR(p.norm(), 2, 1e-12) << v;
        }
    }
    EXPECT_NEAR(StaticSurface(box).distance({0, 0, 2}, 9)->distance, 0.5, 1e-14);
    EXPECT_NEAR(StaticSurface(box).distance({0, 0.9, 0}, 9)->distance, -0.1, 1e-14);
}

TEST(MadeMesh, HasTheHeightsOfATable) {
    Eigen::MatrixXd heights(2, 3);
    heights << 0, 1, 0, 2, 3, 4;
    const TriMesh mesh = height_mesh(heights, {0.5, 0.5});
    ASSERT_EQ(mesh.X.rows(), 6);
    EXPECT_EQ(mesh.X.row(5), Eigen::RowVector3d(1, 0.5, 4));
    EXPECT_EQ(mesh.F.rows(), 4);
    for (Eigen::Index f = 0; f < 4; ++f) {
        const Eigen::Vector3d a = mesh.X.row(mesh.F(f, 0)), b = mesh.X.row(mesh.F(f, 1)),
                              c = mesh.X.row(mesh.F(f, 2));
        EXPECT_GT((b - a).cross(c - a).z(), 0) << "it looks upward";
    }
    const StaticSurface sheet(mesh);
    EXPECT_TRUE(sheet.is_open());
}

TEST(StaticSurface, ThatIsOpenHasTwoSidesAndNoInside) {
    const StaticSurface sheet(height_mesh(Eigen::MatrixXd::Zero(3, 3), {1, 1}));
    for (const double z : {-0.3, 0.3}) {
        const auto found = sheet.distance({0.7, 0.6, z}, 1);
        EXPECT_NEAR(found->distance, 0.3, 1e-14);
        EXPECT_NEAR(found->normal.z(), z < 0 ? -1 : 1, 1e-14);
    }
    EXPECT_EQ(sheet.distance({0.7, 0.6, 0}, 1)->distance, 0);
    EXPECT_NEAR(sheet.distance({3, 1, 0}, 5)->distance, 1, 1e-14);
}

}  // namespace
}  // namespace nbd
