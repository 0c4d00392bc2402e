#include "meshing/body/make_body.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "meshing/body/body_hints.hpp"
#include "meshing/formats/read_surface.hpp"
#include "meshing/surface/check_surface.hpp"
#include "meshing/tets/tetrahedralize.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using test::error_of;
using testing::HasSubstr;

TEST(BoundarySurface, EqualsTheSurfaceThatWasFilled) {
    const TriMesh surface = test::box(1, 2, 3, 3);
    const TriMesh boundary = boundary_surface(tetrahedralize(surface).tets);
    EXPECT_EQ(boundary.X, surface.X);
    EXPECT_EQ(boundary.F.rows(), surface.F.rows());
    EXPECT_NO_THROW(check_surface(boundary));
}

TEST(BoundarySurface, LeavesOutInnerNodesInAnyOrder) {
    TetMesh tets = tetrahedralize(test::box(1, 1, 1, 4)).tets;
    const int n = tets.X.rows();
    tets.X = tets.X.colwise().reverse().eval();  // inner nodes first
    for (int& node : tets.T.reshaped()) node = n - 1 - node;
    const TriMesh boundary = boundary_surface(tets);
    EXPECT_LT(boundary.X.rows(), n);
    EXPECT_NO_THROW(check_surface(boundary));
    for (int v = 0; v < boundary.X.rows(); ++v)
        EXPECT_TRUE((boundary.X.row(v).array() == 0 || boundary.X.row(v).array() == 1).any())
            << "vertex " << v;
}

TEST(MakeBody, KeepsTheVertexOrderOfTheSurface) {
    const TriMesh surface = test::box(1, 1, 1, 4);
    const Material soft{.young = 2e4, .poisson = 0.3};
    const Body body = make_body("box", surface, tetrahedralize(surface).tets, soft);
    EXPECT_EQ(body.name, "box");
    EXPECT_EQ(body.surface.X, surface.X);
    EXPECT_EQ(body.surface.F, surface.F);
    EXPECT_EQ(body.material.young, 2e4);
    EXPECT_EQ(body.W.nonZeros(), surface.X.rows());
    EXPECT_EQ(body.modes.count(), 0);
}

TEST(MakeBody, SubdividesWithWeightsThatFollowTheTets) {
    const TriMesh surface = test::box(1, 1, 1, 4);
    const TetMesh tets = tetrahedralize(surface).tets;
    const Eigen::Matrix3d A = Eigen::Matrix3d::Random();
    for (const auto scheme : {SubdivisionScheme::midpoint, SubdivisionScheme::loop})
        for (const int levels : {1, 2}) {
            const Body body = make_body("box", surface, tets, {}, levels, scheme);
            EXPECT_EQ(body.surface.F.rows(), surface.F.rows() << 2 * levels);
            EXPECT_NO_THROW(check_surface(body.surface));
            // An affine motion of the nodes moves the surface by the same affine map.
            const Nodes moved = body.W * Nodes(tets.X * A), expected = body.surface.X * A;
            EXPECT_LT((moved - expected).cwiseAbs().maxCoeff(), 1e-13);
        }
}

TEST(MakeBody, AcceptsAnySurfaceNearTheTets) {
    const TetMesh tets = tetrahedralize(test::box(1, 1, 1, 4)).tets;
    TriMesh ball = test::icosphere(2);
    ball.X = (0.45 * ball.X).rowwise() + Eigen::RowVector3d(0.5, 0.5, 0.5);
    const Body body = make_body("ball", ball, tets);
    EXPECT_LT((body.W * tets.X - ball.X).cwiseAbs().maxCoeff(), 1e-13);
    ball.X.array() += 3;
    EXPECT_NE(error_of([&] { make_body("ball", ball, tets); }), "");
}

TEST(MakeBody, RejectsMaterialsOutOfRange) {
    const TetMesh tets = tetrahedralize(test::box(1, 1, 1, 2)).tets;
    const auto error = [&](const Material& material) {
        return error_of([&] { make_body("box", tets, material); });
    };
    EXPECT_EQ(error({}), "");
    EXPECT_EQ(error({.young = std::nan("")}), "Young's modulus is nan; allowed: between 1e-30 and 1e30 Pa");
    EXPECT_NE(error_of([&] { make_body("box", tets, {}, 5); }), "");
}

TetMesh filled(const TriMesh& surface) { return tetrahedralize(surface, {}).tets; }

TEST(BodyHints, TellsOfPartsThatAreOneTetrahedronThick) {
    const std::string thin = "is one linear tetrahedron thick in 100 % of its volume";
    EXPECT_THAT(thin_hint(test::box_mesh({1, 0.1, 0.1}, {10, 1, 1})), HasSubstr(thin));
    EXPECT_THAT(thin_hint(test::box_mesh({1, 1, 0.05}, {20, 20, 1})), HasSubstr(thin));
    EXPECT_THAT(thin_hint(filled(test::box(1, 0.1, 0.1, 1))), HasSubstr(thin)) << "CAD's twelve triangles";
    // gmsh adds a few nodes inside.
    EXPECT_THAT(thin_hint(filled(test::box(1, 0.1, 0.1, 2))),
                HasSubstr("is one linear tetrahedron thick in 8"));
    EXPECT_EQ(thin_hint(test::box_mesh({1, 0.1, 0.1}, {20, 2, 2})), "");
    EXPECT_EQ(thin_hint(test::box_mesh({1, 1, 0.05}, {20, 20, 2})), "");
    EXPECT_EQ(thin_hint(filled(test::box(1, 0.1, 0.1, 4))), "");
    EXPECT_EQ(thin_hint(test::box_mesh({1, 1, 1}, {1, 1, 1})), "") << "a cube does not bend";
    EXPECT_EQ(thin_hint(filled(test::icosphere(2))), "");
    EXPECT_EQ(thin_hint(filled(test::torus(1, 0.3, 40, 16))), "");
}

TEST(BodyHints, TellsOfSizesThatAreOfAnotherUnit) {
    const auto hint = [](double size) {
        Body body;
        body.surface = test::box(size, size / 2, size / 3, 1);
        return size_hint(body);
    };
    EXPECT_EQ(
        hint(100),
        "is 100 m long; if its file is in millimetres, `nbdtree mesh --scale 0.001` makes metres of them");
    EXPECT_THAT(hint(1e-4), HasSubstr("is 0.0001 m long; if its file is in another unit than metres"));
    for (const double size : {3e-3, 0.01, 0.1, 1., 10., 19.}) EXPECT_EQ(hint(size), "") << size;
    Body body;
    body.surface = test::box(100, 100, 100, 1);
    EXPECT_EQ(size_hint(body, 1e-3), "") << "a scene may scale it";
}

TEST(BodyHints, TellsOfRatiosThatLock) {
    Material material;
    for (const double ratio : {-0.5, 0., 0.3, 0.4, 0.45}) {
        material.poisson = ratio;
        EXPECT_EQ(locking_hint(test::box_mesh({1, 1, 1}, {1, 1, 1}), material, {}), "") << ratio;
    }
    material.poisson = 0.49;
    const std::string hint = locking_hint(test::box_mesh({1, 1, 1}, {1, 1, 1}), material, {});
    EXPECT_THAT(hint, HasSubstr("has a Poisson's ratio of 0.49, at which linear tetrahedra lock"));
    material.poisson = 0.3;
    MaterialRegion region{.name = "core", .material = {.poisson = 0.499}, .tets = {0}};
    EXPECT_THAT(locking_hint(test::box_mesh({1, 1, 1}, {1, 1, 1}), material, {region}),
                HasSubstr("ratio of 0.499"));
}

}  // namespace
}  // namespace nbd
