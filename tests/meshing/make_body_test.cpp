#include "meshing/body/make_body.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "meshing/formats/read_surface.hpp"
#include "meshing/surface/check_surface.hpp"
#include "meshing/tets/tetrahedralize.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using test::error_of;

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
    EXPECT_EQ(error({.young = 0}), "Young's modulus is 0; allowed: between 1e-30 and 1e30 Pa");
    EXPECT_EQ(error({.young = std::nan("")}), "Young's modulus is nan; allowed: between 1e-30 and 1e30 Pa");
    EXPECT_EQ(error({.poisson = 0.5}), "Poisson's ratio is 0.5; allowed: between -0.999 and 0.499");
    EXPECT_EQ(error({.density = -1}), "density is -1; allowed: between 1e-30 and 1e30 kg/m3");
    EXPECT_EQ(error({.rayleigh_mass = -1}), "Rayleigh mass damping is -1; allowed: between 0 and 1e30 1/s");
    EXPECT_NE(error_of([&] { make_body("box", tets, {}, 5); }), "");
}

TEST(MakeBody, MakesTheFinerArmadillosOfThePaper) {
    const auto path = std::filesystem::path(NBD_SHARED_MESHES) / "armadillo.obj";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " does not exist";
    const TriMesh surface = read_surface(path);
    const TetMesh tets = tetrahedralize(surface).tets;
    EXPECT_EQ(make_body("ARMA", surface, tets).surface.F.rows(), 16204);
    EXPECT_EQ(make_body("ARMAHD", surface, tets, {}, 1).surface.F.rows(), 64816);
    EXPECT_EQ(make_body("ARMAUHD", surface, tets, {}, 2).surface.F.rows(), 259264);
}

TEST(MakeBody, MakesFinerGeckos) {
    const TriMesh surface = read_surface(std::filesystem::path(NBD_ASSETS) / "gecko.obj");
    const TetMesh tets = tetrahedralize(surface).tets;
    const Eigen::Index faces = surface.F.rows();
    EXPECT_EQ(make_body("gecko", surface, tets).surface.F.rows(), faces);
    EXPECT_EQ(make_body("gecko", surface, tets, {}, 1).surface.F.rows(), 4 * faces);
    EXPECT_EQ(make_body("gecko", surface, tets, {}, 2).surface.F.rows(), 16 * faces);
}

}  // namespace
}  // namespace nbd
