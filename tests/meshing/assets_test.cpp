#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include "meshing/formats/read_surface.hpp"
#include "meshing/surface/solid_boundary.hpp"
#include "meshing/tets/tet_quality.hpp"
#include "meshing/tets/tetrahedralize.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

class Asset : public testing::TestWithParam<const char*> {
 protected:
    std::filesystem::path path() const {
        return std::filesystem::path(NBD_ASSETS) / (std::string(GetParam()) + ".obj");
    }
};

TEST_P(Asset, IsSmallCentredAndOfLengthOne) {
    EXPECT_LT(std::filesystem::file_size(path()), 300'000u);
    const TriMesh surface = read_surface(path());
    const Eigen::RowVector3d low = surface.X.colwise().minCoeff(), high = surface.X.colwise().maxCoeff();
    EXPECT_NEAR((high - low).maxCoeff(), 1, 1e-5);
    EXPECT_NEAR((high + low).norm(), 0, 1e-5);
}

TEST_P(Asset, BoundsASolidUnchanged) {
    const TriMesh surface = read_surface(path());
    const SolidBoundary boundary =
        make_solid_boundary(surface);  // rejects self-intersections and other defects
    EXPECT_EQ(boundary.mesh.F, surface.F) << "the check flipped a face";
    EXPECT_EQ(boundary.report.dropped_vertices, 0);
    EXPECT_EQ(boundary.report.shells, 1);
    const bool has_hole = GetParam() == std::string("gear") || GetParam() == std::string("ring");
    EXPECT_EQ(boundary.report.genus, has_hole ? 1 : 0);
}

TEST_P(Asset, HasWellShapedTriangles) {
    const TriMesh surface = read_surface(path());
    double least = 180;
    for (int f = 0; f < surface.F.rows(); ++f)
        for (int c = 0; c < 3; ++c) {
            const Eigen::RowVector3d x = surface.X.row(surface.F(f, c)),
                                     u = surface.X.row(surface.F(f, (c + 1) % 3)) - x,
                                     v = surface.X.row(surface.F(f, (c + 2) % 3)) - x;
            least = std::min(least, std::atan2(u.cross(v).norm(), u.dot(v)) * 180 / std::numbers::pi);
        }
    EXPECT_GT(least, 25);
}

TEST_P(Asset, CanBeFilledWithWellShapedTetrahedra) {
    const TriMesh surface = read_surface(path());
    const TetMesh tets = tetrahedralize(surface).tets;
    const TetQuality quality = tet_quality(tets);
    EXPECT_GT(quality.nodes, 500);
    EXPECT_LT(quality.nodes, 3500);
    EXPECT_GT(quality.radius_ratio_min, 0.15) << to_text(quality);
    EXPECT_GT(quality.radius_ratio_mean, 0.7) << to_text(quality);
    EXPECT_GT(quality.dihedral_min, 8) << to_text(quality);
}

INSTANTIATE_TEST_SUITE_P(All, Asset, testing::Values("gecko", "gear", "ring", "beam"),
                         [](const auto& info) { return std::string(info.param); });

/// Share of the edges of a closed surface whose faces meet at an angle of more than `degrees`.
double bent_edges(const TriMesh& surface, double degrees) {
    std::map<std::pair<int, int>, Eigen::RowVector3d> normals;
    int bent = 0;
    for (int f = 0; f < surface.F.rows(); ++f) {
        const Eigen::RowVector3d a = surface.X.row(surface.F(f, 0));
        const Eigen::RowVector3d normal =
            (surface.X.row(surface.F(f, 1)) - a).cross(surface.X.row(surface.F(f, 2)) - a).normalized();
        for (int c = 0; c < 3; ++c) {
            const int v = surface.F(f, c), w = surface.F(f, (c + 1) % 3);
            const auto [edge, is_new] = normals.try_emplace({std::min(v, w), std::max(v, w)}, normal);
            bent += !is_new && normal.dot(edge->second) < std::cos(degrees * std::numbers::pi / 180);
        }
    }
    return double(bent) / normals.size();
}

TEST(Moloch, IsADetailedSurfaceThatBoundsASolid) {
    const test::TemporaryFolder folder;
    const std::string path = folder / "moloch.obj";
    ASSERT_EQ(std::system(("python3 '" NBD_ASSETS "/moloch.py' '" + path + "' > /dev/null").c_str()), 0);
    const TriMesh surface = read_surface(path);
    EXPECT_GE(surface.F.rows(), 250'000);
    const SolidBoundary boundary = make_solid_boundary(surface);  // rejects self-intersections
    EXPECT_EQ(boundary.mesh.F, surface.F) << "the check flipped a face";
    EXPECT_EQ(boundary.report.dropped_vertices, 0);
    EXPECT_EQ(boundary.report.shells, 1);
    EXPECT_EQ(boundary.report.genus, 0);
    // Of a surface that is subdivided flatly as often, seven edges of eight lie inside a plane.
    EXPECT_GT(bent_edges(surface, 5), 1. / 3);
}

}  // namespace
}  // namespace nbd
