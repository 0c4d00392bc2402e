#include "meshing/surface/subdivide.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "meshing/formats/read_surface.hpp"
#include "meshing/surface/solid_boundary.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using namespace test;

TEST(Subdivide, GivesFourFacesPerFaceAndPositionsByItsMatrix) {
    const TriMesh coarse = torus(1, 0.3, 14, 9);
    for (const SubdivisionScheme scheme : {SubdivisionScheme::midpoint, SubdivisionScheme::loop})
        for (int levels = 0; levels <= 3; ++levels) {
            const auto [mesh, S] = subdivide(coarse, scheme, levels);
            ASSERT_EQ(mesh.F.rows(), coarse.F.rows() << 2 * levels);
            EXPECT_EQ(mesh.X.rows(), coarse.X.rows() << 2 * levels) << "genus 1";
            EXPECT_LT((S * Eigen::VectorXd::Ones(S.cols())).array().operator-(1).abs().maxCoeff(), 1e-14);
            EXPECT_EQ(mesh.X, Nodes(S * coarse.X));
            const SurfaceReport report = make_solid_boundary(mesh).report;  // closed, manifold, ...
            EXPECT_EQ(report.genus, 1);
            EXPECT_EQ(report.turned_faces + report.dropped_vertices, 0);
        }
}

TEST(Subdivide, MidpointsKeepTheShape) {
    const TriMesh coarse = as_from_file(icosphere(1));
    const SurfaceReport before = make_solid_boundary(coarse).report;
    const auto [mesh, S] = subdivide(coarse, SubdivisionScheme::midpoint, 2);
    const SurfaceReport after = make_solid_boundary(mesh).report;
    EXPECT_NEAR(after.volume, before.volume, 1e-14);
    EXPECT_NEAR(after.area, before.area, 1e-13);
    EXPECT_EQ(mesh.X.topRows(coarse.X.rows()), coarse.X);
    // Every fine face lies in the plane of its coarse face.
    for (int f = 0; f < mesh.F.rows(); ++f) {
        const auto normal = [](const TriMesh& m, int g) {
            const Eigen::RowVector3d a = m.X.row(m.F(g, 0));
            return (m.X.row(m.F(g, 1)) - a).cross(m.X.row(m.F(g, 2)) - a).normalized().eval();
        };
        ASSERT_GT(normal(mesh, f).dot(normal(coarse, f / 16)), 1 - 1e-12);
    }
}

TEST(Subdivide, LoopPreservesPlanesAndSmoothsEdges) {
    const auto [mesh, S] = subdivide(box(2, 2, 2, 4), SubdivisionScheme::loop, 1);
    int in_plane = 0;
    for (int v = 0; v < 98; ++v) {  // regular vertices inside a side do not move
        const Eigen::RowVector3d before = box(2, 2, 2, 4).X.row(v), after = mesh.X.row(v);
        const int inner = ((before.array() > 0.4) && (before.array() < 1.6)).count();
        if (inner != 2) continue;
        ++in_plane;
        EXPECT_LT((after - before).norm(), 1e-14);
    }
    EXPECT_EQ(in_plane, 6 * 9);
    const double sharp = make_solid_boundary(box(2, 2, 2, 4)).report.volume;
    const double smooth = make_solid_boundary(mesh).report.volume;
    EXPECT_LT(smooth, sharp - 0.05);
    EXPECT_GT(smooth, 0.8 * sharp);
}

TEST(Subdivide, LoopConvergesToASmoothSurface) {
    // Angles between neighbouring faces halve with each level.
    const TriMesh coarse = icosphere(0);
    double previous = 10;
    for (int levels = 1; levels <= 3; ++levels) {
        const TriMesh mesh = subdivide(coarse, SubdivisionScheme::loop, levels).mesh;
        double largest = 0;
        for (int f = 0; f < mesh.F.rows(); f += 4) {
            const auto normal = [&](int g) {
                const Eigen::RowVector3d a = mesh.X.row(mesh.F(g, 0));
                return (mesh.X.row(mesh.F(g, 1)) - a).cross(mesh.X.row(mesh.F(g, 2)) - a).normalized().eval();
            };
            for (int k = 0; k < 3; ++k)
                largest = std::max(largest, std::acos(std::min(1., normal(f + k).dot(normal(f + 3)))));
        }
        EXPECT_LT(largest, 0.65 * previous);
        previous = largest;
    }
}

TEST(Subdivide, RejectsInvalidLevelsAndOpenSurfaces) {
    EXPECT_EQ(error_of([] { subdivide(tetrahedron(), SubdivisionScheme::loop, 5); }),
              "subdivision by 5 levels; allowed: 0 to 4");
    EXPECT_EQ(error_of([] { subdivide(tetrahedron(), SubdivisionScheme::loop, -1); }),
              "subdivision by -1 levels; allowed: 0 to 4");
    TriMesh open = tetrahedron();
    open.F.conservativeResize(3, 3);
    EXPECT_NE(error_of([&] { subdivide(open, SubdivisionScheme::midpoint, 1); }).find("the surface is open"),
              std::string::npos);
}

TEST(Subdivide, GivesTheSizesOfTable1) {
    const std::filesystem::path file = std::filesystem::path(NBD_SHARED_MESHES) / "armadillo.obj";
    if (!std::filesystem::exists(file)) GTEST_SKIP() << "missing file: " << file;
    const TriMesh arma = make_solid_boundary(read_surface(file)).mesh;
    const int faces[] = {16204, 64816, 259264}, vertices[] = {8104, 32410, 129634};
    for (int levels = 0; levels < 3; ++levels) {
        const TriMesh mesh = subdivide(arma, SubdivisionScheme::midpoint, levels).mesh;
        EXPECT_EQ(mesh.F.rows(), faces[levels]);
        EXPECT_EQ(mesh.X.rows(), vertices[levels]);
    }
}

}  // namespace
}  // namespace nbd
