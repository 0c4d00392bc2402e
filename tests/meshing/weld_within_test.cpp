#include "meshing/surface/weld.hpp"

#include <gtest/gtest.h>

#include <random>

#include "meshing/surface/check_surface.hpp"
#include "meshing/surface/solid_boundary.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using namespace test;

/// A box each of whose faces has corners of its own, up to `crack` away from where they belong.
TriMesh cracked_box(double crack) {
    const TriMesh whole = box(1, 2, 3, 3);
    TriMesh cracked{Nodes(3 * whole.F.rows(), 3), Faces(whole.F.rows(), 3)};
    std::mt19937 random(1);
    std::uniform_real_distribution<double> part(-1, 1);
    for (int i = 0; i < whole.F.size(); ++i) {
        const Eigen::RowVector3d off(part(random), part(random), part(random));
        cracked.X.row(i) = whole.X.row(whole.F(i / 3, i % 3)) + crack / 2 * off.normalized();
        cracked.F(i / 3, i % 3) = i;
    }
    return cracked;
}

TEST(WeldWithin, ClosesCracksUpToTheLength) {
    const TriMesh cracked = cracked_box(1e-4);
    WeldReport report;
    const TriMesh welded = weld_within(cracked, 2e-4, report);
    EXPECT_EQ(welded.X.rows(), box(1, 2, 3, 3).X.rows());
    EXPECT_NEAR(make_solid_boundary(welded).report.volume, 6, 1e-2);
    EXPECT_EQ(report.merged_vertices, cracked.X.rows() - welded.X.rows());
    EXPECT_EQ(report.dropped_faces, 0);
    EXPECT_NE(test::error_of([&] {
                  check_surface(weld_within(cracked, 1e-6, report));
              }).find("the surface is open"),
              std::string::npos);
}

/// A box whose face at the largest x is cut finer than its neighbours: a vertex in the middle of each of its
/// edges.
TriMesh box_with_t_junctions() {
    TriMesh mesh = box(1, 1, 1, 1);
    std::vector<std::array<int, 3>> rows;
    for (int f = 0; f < mesh.F.rows(); ++f) {
        bool on_side = true;
        for (int c = 0; c < 3; ++c) on_side = on_side && mesh.X(mesh.F(f, c), 0) == 1;
        if (!on_side) rows.push_back({mesh.F(f, 0), mesh.F(f, 1), mesh.F(f, 2)});
    }
    const TriMesh fine = box(1, 1, 1, 2);
    const int base = mesh.X.rows();
    Nodes X(mesh.X.rows() + fine.X.rows(), 3);
    X << mesh.X, fine.X;
    for (int f = 0; f < fine.F.rows(); ++f) {
        bool on_side = true;
        for (int c = 0; c < 3; ++c) on_side = on_side && fine.X(fine.F(f, c), 0) == 1;
        if (on_side) rows.push_back({base + fine.F(f, 0), base + fine.F(f, 1), base + fine.F(f, 2)});
    }
    TriMesh result{X, Faces(rows.size(), 3)};
    for (std::size_t f = 0; f < rows.size(); ++f) result.F.row(f) << rows[f][0], rows[f][1], rows[f][2];
    return result;
}

TEST(WeldWithin, DividesEdgesAtTheVerticesBesideThem) {
    const TriMesh mesh = box_with_t_junctions();
    WeldReport report;
    const SolidBoundary boundary = make_solid_boundary(weld_within(mesh, 1e-9, report));
    EXPECT_EQ(report.split_edges, 4);
    EXPECT_NEAR(boundary.report.volume, 1, 1e-12);
    EXPECT_EQ(boundary.report.turned_faces, 0);
}

TEST(WeldWithin, KeepsAClosedSurfaceBitForBit) {
    const TriMesh mesh = torus(1, 0.3, 12, 8);
    WeldReport report;
    const TriMesh welded = weld_within(mesh, 1e-3, report);
    EXPECT_EQ(welded.X, mesh.X);
    EXPECT_EQ(welded.F, mesh.F);
    EXPECT_EQ(describe(report),
              "welded within 0.001 m: 0 vertices merged, 0 open edges divided, 0 collapsed faces dropped");
}

TEST(WeldWithin, DropsFacesThatCollapse) {
    WeldReport report;
    const TriMesh welded = weld_within(icosphere(2), 0.3, report);
    EXPECT_GT(report.dropped_faces, 0);
    EXPECT_EQ(welded.F.rows(), 320 - report.dropped_faces);
    for (int f = 0; f < welded.F.rows(); ++f) EXPECT_NE(welded.F(f, 0), welded.F(f, 1));
    EXPECT_NE(test::error_of([&] { weld_within(icosphere(0), 0, report); }), "");
}

}  // namespace
}  // namespace nbd
