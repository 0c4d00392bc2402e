#include "meshing/surface/solid_boundary.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>

#include "collision/geometry/triangle_triangle.hpp"
#include "meshing/formats/read_surface.hpp"
#include "meshing/surface/check_surface.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using namespace test;

std::string refusal(const TriMesh& mesh, const SolidBoundaryConfig& config = {}) {
    return error_of([&] { make_solid_boundary(mesh, config); });
}

TriMesh without_faces(const TriMesh& mesh, int first, int count) {
    TriMesh rest{mesh.X, Faces(mesh.F.rows() - count, 3)};
    rest.F << mesh.F.topRows(first), mesh.F.bottomRows(mesh.F.rows() - first - count);
    return rest;
}

TriMesh with_face(TriMesh mesh, int a, int b, int c) {
    mesh.F.conservativeResize(mesh.F.rows() + 1, 3);
    mesh.F.bottomRows(1) << a, b, c;
    return mesh;
}

TriMesh turned(TriMesh mesh, int first, int count) {
    for (int f = first; f < first + count; ++f) std::swap(mesh.F(f, 1), mesh.F(f, 2));
    return mesh;
}

/// Tetrahedra that index one vertex array; shared vertices are welded.
TriMesh tetrahedra(std::initializer_list<Eigen::RowVector3d> X,
                   std::initializer_list<std::array<int, 4>> tets) {
    TriMesh mesh{Nodes(X.size(), 3), Faces(4 * tets.size(), 3)};
    int row = 0;
    for (const auto& x : X) mesh.X.row(row++) = x;
    row = 0;
    for (const auto& [a, b, c, d] : tets)
        for (const auto& face :
             {std::array{a, c, b}, std::array{a, b, d}, std::array{b, c, d}, std::array{a, d, c}})
            mesh.F.row(row++) << face[0], face[1], face[2];
    return mesh;
}

/// A sphere with one vertex pushed through the opposite side.
TriMesh pierced_sphere() {
    TriMesh mesh = as_from_file(icosphere(2));
    mesh.X.row(0) *= -1.5;
    return mesh;
}

/// A Klein bottle: a torus grid closed with a reflection.
TriMesh klein_bottle(int nu, int nv) {
    TriMesh mesh = torus(1, 0.3, nu, nv);
    const int last = (nu - 1) * nv;
    for (int f = 2 * last; f < mesh.F.rows(); ++f)
        for (int c = 0; c < 3; ++c)
            if (mesh.F(f, c) < nv) mesh.F(f, c) = (nv - mesh.F(f, c)) % nv;
    return mesh;
}

TEST(SolidBoundary, LeavesValidSurfacesUnchanged) {
    const TriMesh ball = as_from_file(icosphere(3)), ring = as_from_file(torus(1, 0.3, 60, 30));
    for (const TriMesh& mesh : {ball, ring, as_from_file(box(1, 2, 3, 4))}) {
        const auto [solid, report] = make_solid_boundary(mesh);
        EXPECT_EQ(solid.X, mesh.X);
        EXPECT_EQ(solid.F, mesh.F);
        EXPECT_EQ(report.faces, mesh.F.rows());
        EXPECT_EQ(report.shells, 1);
        EXPECT_EQ(report.cavities + report.dropped_vertices + report.turned_faces + report.intersecting_pairs,
                  0);
    }
    EXPECT_EQ(make_solid_boundary(ball).report.genus, 0);
    EXPECT_EQ(make_solid_boundary(ring).report.genus, 1);
    EXPECT_NEAR(make_solid_boundary(ring).report.volume, 2 * std::numbers::pi * std::numbers::pi * 0.09,
                0.02);
    EXPECT_NEAR(make_solid_boundary(ball).report.area, 4 * std::numbers::pi, 0.1);
    const SurfaceReport cuboid = make_solid_boundary(box(1, 2, 3, 1)).report;
    EXPECT_NEAR(cuboid.volume, 6, 1e-12);
    EXPECT_EQ(describe(cuboid), "8 vertices, 12 faces, 1 shell, genus 0, area 22 m2, volume 6 m3");
}

TEST(SolidBoundary, FlipsAnInsideOutSurface) {
    const TriMesh mesh = as_from_file(icosphere(2));
    const auto [solid, report] = make_solid_boundary(turned(mesh, 0, 320));
    EXPECT_EQ(solid.F, mesh.F);
    EXPECT_EQ(report.turned_faces, 320);
    EXPECT_NE(describe(report).find("; turned every face: the surface was inside out"), std::string::npos);
}

TEST(SolidBoundary, MakesOrientationsAgree) {
    const TriMesh mesh = as_from_file(torus(1, 0.3, 20, 10));
    for (const auto& [first, count] : {std::pair{0, 1}, {7, 1}, {0, 390}, {100, 33}}) {
        const auto [solid, report] = make_solid_boundary(turned(mesh, first, count));
        EXPECT_EQ(solid.F, mesh.F);
        EXPECT_EQ(report.turned_faces, count);
    }
}

TEST(SolidBoundary, DropsUnreferencedVertices) {
    TriMesh mesh = as_from_file(icosphere(1));
    const Nodes X = mesh.X;
    mesh.X.resize(X.rows() + 2, 3);
    mesh.X << X.topRows(5), Eigen::RowVector3d(7, 7, 7), X.bottomRows(X.rows() - 5),
        Eigen::RowVector3d(8, 8, 8);
    mesh.F = (mesh.F.array() >= 5).select(mesh.F.array() + 1, mesh.F);
    const auto [solid, report] = make_solid_boundary(mesh);
    EXPECT_EQ(solid.X, X);
    EXPECT_EQ(solid.F, icosphere(1).F);
    EXPECT_EQ(report.dropped_vertices, 2);
    EXPECT_NE(describe(report).find("; dropped 2 unreferenced vertices"), std::string::npos);
}

TEST(SolidBoundary, ReportsInvalidPositionsAndIndices) {
    const TriMesh good = tetrahedron();
    EXPECT_EQ(refusal({good.X, Faces(0, 3)}), "the surface has no faces");
    TriMesh mesh = good;
    mesh.X(2, 1) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(refusal(mesh), "vertex 2 is not finite: (0, nan, 0)");
    mesh.X(2, 1) = -std::numeric_limits<double>::infinity();
    EXPECT_EQ(refusal(mesh), "vertex 2 is not finite: (0, -inf, 0)");
    mesh = good;
    mesh.F(3, 1) = 4;
    EXPECT_EQ(refusal(mesh), "face 3 refers to vertex 4, but the surface has 4 vertices");
    mesh.F(3, 1) = -1;
    EXPECT_EQ(refusal(mesh), "face 3 refers to vertex -1, but the surface has 4 vertices");
}

TEST(SolidBoundary, ReportsDegenerateAndDuplicateFaces) {
    const TriMesh good = tetrahedron();
    EXPECT_EQ(refusal(with_face(good, 1, 1, 2)),
              "face 4 repeats a vertex (1 1 2, at (1, 0, 0)); 1 such face");
    TriMesh flat = good;
    flat.X.row(2) << 2, 0, 0;  // collinear with the first two
    EXPECT_EQ(refusal(flat), "face 0 has no area (vertices 0 2 1, at (0, 0, 0)); 1 such face");
    flat.X.row(2) << 1, 0, 0;  // equal to the second
    EXPECT_EQ(refusal(flat), "face 0 has no area (vertices 0 2 1, at (0, 0, 0)); 2 such faces");
    flat.X.row(2) << 2, 1e-9, 0;
    EXPECT_EQ(refusal(flat), "face 0 has no area (vertices 0 2 1, at (0, 0, 0)); 1 such face");
    EXPECT_EQ(refusal(with_face(good, 1, 3, 0)), "face 4 has the same vertices as face 1; 1 duplicate face");
    EXPECT_EQ(refusal(with_face(good, 0, 3, 1)), "face 4 has the same vertices as face 1; 1 duplicate face")
        << "also with opposite orientation";
}

TEST(SolidBoundary, ReportsOpenEdges) {
    EXPECT_EQ(refusal(without_faces(tetrahedron(), 2, 1)),
              "the surface is open: edge 1-2 at (1, 0, 0) belongs only to face 0; 3 open edges");
    EXPECT_NE(refusal(without_faces(icosphere(2), 18, 2)).find("; 4 open edges"), std::string::npos);
    const TriMesh one = without_faces(tetrahedron(), 1, 3);
    EXPECT_EQ(refusal(one),
              "the surface is open: edge 0-1 at (0, 0, 0) belongs only to face 0; 3 open edges");
    // Unwelded: no two faces share a vertex.
    TriMesh unwelded = tetrahedron();
    unwelded.X = Nodes(12, 3);
    for (int i = 0; i < 12; ++i) {
        unwelded.X.row(i) = tetrahedron().X.row(tetrahedron().F(i / 3, i % 3));
        unwelded.F(i / 3, i % 3) = i;
    }
    EXPECT_NE(refusal(unwelded).find("; 12 open edges"), std::string::npos);
}

TEST(SolidBoundary, ReportsEdgesOfMoreThanTwoFaces) {
    const auto fin = with_face(icosphere(1), icosphere(1).F(0, 0), icosphere(1).F(0, 1), 41);
    EXPECT_NE(refusal(fin).find(", but an edge of a solid has 2; "), std::string::npos) << refusal(fin);
    // Two tetrahedra sharing the edge from 0 to 1.
    const TriMesh hinged = tetrahedra({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, 0}, {0, 0, -1}},
                                      {{0, 1, 2, 3}, {0, 1, 4, 5}});
    EXPECT_EQ(
        refusal(hinged),
        "edge 0-1 at (0, 0, 0) belongs to 4 faces (0, 1, 4, ...), but an edge of a solid has 2; 1 such edge");
}

TEST(SolidBoundary, ReportsNonManifoldVertices) {
    const TriMesh kissing =
        tetrahedra({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}},
                   {{0, 1, 2, 3}, {0, 5, 4, 6}});
    EXPECT_EQ(refusal(kissing),
              "vertex 0 at (0, 0, 0) is not manifold: the parts around it at faces 0 and 4 meet only there; "
              "1 such joint");
    const TriMesh necklace = tetrahedra({{0, 0, 0},
                                         {1, 0, 0},
                                         {0, 1, 0},
                                         {0, 0, 1},
                                         {2, 0, 0},
                                         {1, 1, 0},
                                         {1, 0, 1},
                                         {3, 0, 0},
                                         {2, 1, 0},
                                         {2, 0, 1}},
                                        {{0, 1, 2, 3}, {1, 4, 5, 6}, {4, 7, 8, 9}});
    EXPECT_NE(refusal(necklace).find("vertex 1 at (1, 0, 0)"), std::string::npos);
    EXPECT_NE(refusal(necklace).find("; 2 such joints"), std::string::npos);
}

TEST(SolidBoundary, RejectsANonOrientableSurface) {
    const std::string error = refusal(klein_bottle(12, 8));
    EXPECT_NE(error.find("the surface is one-sided"), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
}

TEST(SolidBoundary, RejectsAComponentWithoutVolume) {
    TriMesh flat = as_from_file(icosphere(1));
    flat.X.col(0) += 0.3 * flat.X.col(2);
    flat.X.col(1) += 0.17 * flat.X.col(2);
    flat.X.col(2).setZero();
    EXPECT_EQ(
        refusal(flat, {.allow_self_intersection = true}).find("the component of face 0 encloses no volume"),
        0u)
        << refusal(flat, {.allow_self_intersection = true});
}

TEST(SolidBoundary, DistinguishesComponentsShellsAndCavities) {
    const TriMesh ball = as_from_file(icosphere(2));
    const TriMesh two = joined(ball, moved(ball, 3, 0, 0));
    EXPECT_EQ(
        refusal(two),
        "the surface has 2 components (2 shells and 0 cavities; the second shell starts at face 320), but a "
        "body must be one shell, with or without cavities");
    // The second sphere becomes a cavity; the third, inside it, is a shell again.
    const TriMesh hollow = joined(joined(ball, moved(ball, 0, 0, 0, 0.5)), moved(ball, 0, 0, 0, 0.25));
    EXPECT_NE(refusal(hollow).find("3 components (2 shells and 1 cavity;"), std::string::npos)
        << refusal(hollow);
    const auto [solid, report] = make_solid_boundary(hollow, {.allow_components = true});
    EXPECT_EQ(report.shells, 2);
    EXPECT_EQ(report.cavities, 1);
    EXPECT_EQ(report.turned_faces, 320);
    EXPECT_EQ(solid.F.topRows(320), hollow.F.topRows(320));
    EXPECT_NE(solid.F.middleRows(320, 320), hollow.F.middleRows(320, 320));
    const double volume = make_solid_boundary(ball).report.volume;
    EXPECT_NEAR(report.volume, volume * (1 - 0.125 + 0.015625), 1e-6);
    // The ball lies inside the bounding box of the ring, but outside the ring.
    const TriMesh ring = joined(as_from_file(torus(2, 0.3, 40, 20)), ball);
    EXPECT_EQ(make_solid_boundary(ring, {.allow_components = true}).report.shells, 2);
}

TEST(SolidBoundary, FindsSelfIntersections) {
    const std::string error = refusal(pierced_sphere());
    EXPECT_EQ(error.find("the surface intersects itself: faces "), 0u) << error;
    const SurfaceReport report =
        make_solid_boundary(pierced_sphere(), {.allow_self_intersection = true}).report;
    EXPECT_GT(report.intersecting_pairs, 4);
    ASSERT_TRUE(report.first_intersection);
    EXPECT_LT(report.first_intersection->a, report.first_intersection->b);
    EXPECT_NE(describe(report).find("; intersects itself: "), std::string::npos);

    const TriMesh ball = as_from_file(icosphere(2));
    EXPECT_EQ(refusal(joined(ball, moved(ball, 1, 0, 0)), {.allow_components = true})
                  .find("the surface intersects itself"),
              0u);
}

TEST(SelfIntersections, AgreesWithBruteForceForFacesWithoutACommonVertex) {
    TriMesh mesh = as_from_file(torus(1, 0.3, 16, 8));
    mesh.X.col(0) = mesh.X.col(0).cwiseMin(0.2);  // flattens a part, so the surface intersects itself
    mesh.X.row(3) << -1.2, 0, 0;
    int far = 0;
    for (const FacePair& pair : self_intersections(mesh)) {
        int common = 0;
        for (int k = 0; k < 3; ++k)
            for (int l = 0; l < 3; ++l) common += mesh.F(pair.a, k) == mesh.F(pair.b, l);
        far += common == 0;
    }
    int expected = 0;
    const auto triangle = [&](int f) {
        const Vertices X = mesh.X.cast<float>();
        return Triangle{X.row(mesh.F(f, 0)), X.row(mesh.F(f, 1)), X.row(mesh.F(f, 2))};
    };
    for (int f = 0; f < mesh.F.rows(); ++f)
        for (int g = f + 1; g < mesh.F.rows(); ++g) {
            int common = 0;
            for (int k = 0; k < 3; ++k)
                for (int l = 0; l < 3; ++l) common += mesh.F(f, k) == mesh.F(g, l);
            expected += common == 0 && triangles_intersect(triangle(f), triangle(g));
        }
    ASSERT_GT(expected, 10);
    EXPECT_EQ(far, expected);
}

TEST(SelfIntersections, CountsNeighboursOnlyIfTheyMeetBeyondTheirSharedPart) {
    // Faces 0 1 2 and 1 0 3 share an edge; the position of vertex 3 decides: apart, coplanar or folded over.
    const auto on_edge = [](double x, double y, double z) {
        TriMesh mesh{Nodes(4, 3), Faces(2, 3)};
        mesh.X << 0, 0, 0, 1, 0, 0, 0.5, 1, 0, x, y, z;
        mesh.F << 0, 1, 2, 1, 0, 3;
        return self_intersections(mesh).size();
    };
    EXPECT_EQ(on_edge(0.5, -1, 0), 0u);
    EXPECT_EQ(on_edge(0.5, 0, 1), 0u);
    EXPECT_EQ(on_edge(0.5, 1, 1e-6), 0u) << "nearly folded";
    EXPECT_EQ(on_edge(0.5, 0.5, 0), 1u) << "inside";
    EXPECT_EQ(on_edge(0.5, 2, 0), 1u) << "around";
    EXPECT_EQ(on_edge(3, 1, 0), 1u) << "crossing to the right";
    EXPECT_EQ(on_edge(-3, 1, 0), 1u) << "crossing to the left";
    // Faces 0 1 2 and 0 3 4 share a vertex.
    const auto on_vertex = [](double ax, double ay, double az, double bx, double by, double bz) {
        TriMesh mesh{Nodes(5, 3), Faces(2, 3)};
        mesh.X << 0, 0, 0, 1, 0, 0, 0, 1, 0, ax, ay, az, bx, by, bz;
        mesh.F << 0, 1, 2, 0, 3, 4;
        return self_intersections(mesh).size();
    };
    EXPECT_EQ(on_vertex(-1, 0, 0, 0, -1, 0), 0u);
    EXPECT_EQ(on_vertex(1, 1, 1, 2, 2, 1), 0u);
    EXPECT_EQ(on_vertex(0.2, 0.2, -1, 0.2, 0.2, 1), 1u) << "an edge of the first pierces the second";
    EXPECT_EQ(on_vertex(2, 2, -1, 2, 2, 1), 1u) << "an edge of the second pierces the first";
    EXPECT_EQ(on_vertex(0.1, 0.2, 0, 0.2, 0.1, 0), 1u) << "inside, coplanar";
    EXPECT_EQ(on_vertex(1, 0.5, 0, 0.5, 1, 0), 1u) << "overlapping, coplanar";
    EXPECT_EQ(on_vertex(0.5, 0.5, 0, 1, 1, 1), 1u) << "touching an edge";
}

TEST(SolidBoundary, RejectsBrokenFilesOfEveryFormat) {
    const TemporaryFolder folder;
    const TriMesh ball = as_from_file(icosphere(1));
    const auto F = [&](int f, int c) { return ball.F(f, c); };
    const struct {
        const char* name;
        std::string content, text;
    } cases[] = {
        {"open.stl", binary_stl_file(without_faces(ball, 3, 1)), "; 3 open edges"},
        {"open.off", off_file(without_faces(ball, 3, 1)), "; 3 open edges"},
        {"half.obj", obj_file(without_faces(ball, 40, 40)), "the surface is open"},
        {"twice.ply", ascii_ply_file(with_face(ball, F(5, 1), F(5, 2), F(5, 0))),
         "face 80 has the same vertices as face 5; 1 duplicate face"},
        {"fin.glb", glb_file(with_face(ball, F(0, 0), F(0, 1), F(70, 0))), "belongs to 3 faces"},
        {"point.obj", obj_file(with_face(ball, 4, 4, 4)), "face 80 repeats a vertex"},
        {"pierced.ply", binary_ply_file(pierced_sphere(), false), "the surface intersects itself"},
        {"two.stl", ascii_stl_file(joined(ball, moved(ball, 4, 0, 0))), "2 components"},
        {"nested.off", off_file(joined(joined(ball, moved(ball, 0, 0, 0, 0.5)), moved(ball, 0, 0, 0, 0.2))),
         "(2 shells and 1 cavity; the second shell starts at face 160)"},
        {"klein.obj", obj_file(klein_bottle(10, 6)), "is one-sided"},
    };
    for (const auto& [name, content, text] : cases) {
        const std::string error = refusal(read_surface(folder.write(name, content)));
        EXPECT_NE(error.find(text), std::string::npos) << name << ": " << error;
    }
    EXPECT_EQ(refusal(read_surface(folder.write("good.stl", binary_stl_file(ball)))), "");
}

TEST(SolidBoundary, AcceptsTheTestMeshes) {
    const std::filesystem::path meshes = NBD_SHARED_MESHES;
    if (!std::filesystem::exists(meshes / "bunny.obj")) GTEST_SKIP() << "no meshes in " << meshes;
    for (const auto& [name, faces, genus] : {std::tuple{"bunny.obj", 6244, 0},
                                             {"armadillo.obj", 16204, 0},
                                             {"spot.obj", 6000, 0},
                                             {"blub.obj", 8000, 0},
                                             {"bob.obj", 6000, 1},
                                             {"scorpion.obj", 14000, 0},
                                             {"octopus.obj", 12000, 0},
                                             {"gear.obj", 6700, 1},
                                             {"ring.obj", 6624, 1}}) {
        SCOPED_TRACE(name);
        const SurfaceReport report = make_solid_boundary(read_surface(meshes / name)).report;
        EXPECT_EQ(report.faces, faces);
        EXPECT_EQ(report.genus, genus);
        EXPECT_EQ(report.turned_faces + report.dropped_vertices, 0);
    }
}

}  // namespace
}  // namespace nbd
