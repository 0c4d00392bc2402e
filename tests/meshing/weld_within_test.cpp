#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "meshing/surface/check_surface.hpp"
#include "meshing/surface/mesh.hpp"
#include "meshing/surface/solid_boundary.hpp"
#include "meshing/surface/weld.hpp"
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

TriMesh inside_out(TriMesh mesh) {
    mesh.F.col(1).swap(mesh.F.col(2));
    return mesh;
}

TEST(TurnOutward, TurnsASurfaceThatIsInsideOut) {
    TriMesh mesh = inside_out(icosphere(1));
    EXPECT_EQ(turn_outward(mesh), 80);
    EXPECT_EQ(mesh.F, icosphere(1).F);
    EXPECT_EQ(turn_outward(mesh), 0);
}

TEST(TurnOutward, TurnsSingleFacesAndEachPart) {
    TriMesh mesh = joined(icosphere(1), moved(inside_out(icosphere(1)), 5, 0, 0));
    std::swap(mesh.F(3, 0), mesh.F(3, 1));
    EXPECT_EQ(turn_outward(mesh), 81);
    EXPECT_EQ(turn_outward(mesh), 0);
}

TEST(TurnOutward, TurnsTheWallOfAHollowIntoIt) {
    TriMesh mesh = joined(icosphere(1), moved(icosphere(1), 0, 0, 0, 0.5));
    EXPECT_EQ(turn_outward(mesh), 80);
    EXPECT_EQ(mesh.F.topRows(80), icosphere(1).F);
}

TEST(TurnOutward, LeavesOpenSurfacesAlone) {
    TriMesh mesh = inside_out(icosphere(1));
    mesh.F.conservativeResize(79, 3);
    const Faces before = mesh.F;
    EXPECT_EQ(turn_outward(mesh), 0);
    EXPECT_EQ(mesh.F, before);
}

TEST(Containment, TellsWhatLiesWithin) {
    const TriMesh large = moved(torus(2, 1, 24, 16), 0, 0, 0), small = moved(icosphere(1), 2, 0, 0, 0.5),
                  beside = moved(icosphere(1), 0, 0, 0, 0.5), away = moved(icosphere(1), 9, 0, 0, 0.5);
    EXPECT_EQ(containment(small, large), Containment::whole);
    EXPECT_EQ(containment(inside_out(small), inside_out(large)), Containment::whole);
    EXPECT_EQ(containment(large, small), Containment::none);
    EXPECT_EQ(containment(beside, large), Containment::none) << "in the hole of the torus";
    EXPECT_EQ(containment(joined(small, away), large), Containment::some_parts);
    TriMesh open = large;
    open.F.conservativeResize(open.F.rows() - 1, 3);
    EXPECT_EQ(containment(small, open), Containment::none) << "an open surface has no inside";
}

/// The same by a fine grid of points.
double gap_of_samples(const TriMesh& face) {
    constexpr int n = 400;
    double largest = 0;
    for (int i = 0; i <= n; ++i)
        for (int j = 0; i + j <= n; ++j) {
            const Eigen::RowVector3d p =
                (i * face.X.row(0) + j * face.X.row(1) + (n - i - j) * face.X.row(2)) / n;
            largest = std::max(largest, (face.X.rowwise() - p).rowwise().norm().minCoeff());
        }
    return largest;
}

TEST(VertexGap, IsTheLargestDistanceOfAPointOfAFaceFromItsVertices) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> at(-1, 1);
    int obtuse = 0;
    for (int k = 0; k < 50; ++k) {
        TriMesh face{Nodes(3, 3), Faces(1, 3)};
        face.F << 0, 1, 2;
        for (double& x : face.X.reshaped()) x = at(random);
        const double gap = vertex_gap(face), found = gap_of_samples(face);
        double longest = 0;
        for (int i = 0; i < 3; ++i) {
            const Eigen::RowVector3d u = face.X.row((i + 1) % 3) - face.X.row(i),
                                     v = face.X.row((i + 2) % 3) - face.X.row(i);
            longest = std::max(longest, u.norm());
            obtuse += u.dot(v) < 0;
        }
        EXPECT_LE(found, gap * (1 + 1e-12));
        EXPECT_GE(found, gap - 0.01 * longest);
        EXPECT_LE(gap, longest / std::sqrt(3.0));
    }
    EXPECT_GT(obtuse, 10);
    EXPECT_LT(obtuse, 45);
}

TEST(VertexGap, IsThatOfTheCoarsestFace) {
    EXPECT_NEAR(vertex_gap(test::box(4, 1, 1, 1)), std::sqrt(17.0) / 2, 1e-12);
    EXPECT_NEAR(vertex_gap(test::box(4, 1, 1, 2)), std::sqrt(17.0) / 4, 1e-12);
    EXPECT_EQ(vertex_gap({}), 0);
}

}  // namespace
}  // namespace nbd
