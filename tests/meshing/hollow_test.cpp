// Bodies with cavities: their surfaces, and what fills them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "meshing/remesh/remesh.hpp"
#include "meshing/surface/shells.hpp"
#include "meshing/surface/solid_boundary.hpp"
#include "meshing/tets/tet_quality.hpp"
#include "meshing/tets/tetrahedralize.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::icosphere;
using test::joined;
using test::moved;

TriMesh hollow_ball(int level, double inner, double size = 1) {
    const TriMesh ball = moved(icosphere(level), 0, 0, 0, size);
    return joined(ball, moved(ball, 0, 0, 0, inner));
}

/// The same surface with its vertices in another order, in which shells alternate.
TriMesh shuffled(const TriMesh& mesh) {
    const auto count = static_cast<int>(mesh.X.rows());
    TriMesh result = mesh;
    const auto place = [&](int v) { return static_cast<int>((7LL * v + 3) % count); };
    for (int v = 0; v < count; ++v) result.X.row(place(v)) = mesh.X.row(v);
    for (int& v : result.F.reshaped()) v = place(v);
    return result;
}

void expect_fills(const TriMesh& surface) {
    const auto [solid, report] = make_solid_boundary(surface);
    EXPECT_EQ(report.shells, 1);
    const TetMesh tets = tetrahedralize(solid).tets;
    ASSERT_GT(tets.T.rows(), 0);
    EXPECT_EQ(tets.X.topRows(solid.X.rows()), solid.X);
    EXPECT_EQ(test::sorted_faces(boundary_faces(tets)), test::sorted_faces(solid.F));
    EXPECT_NEAR(tet_quality(tets).volume, report.volume, 1e-12 * report.volume);
}

TEST(HollowBodies, AreFilledBetweenTheirShellsAtAnySize) {
    for (const double size : {1e-3, 1.0, 100.0}) {
        expect_fills(hollow_ball(2, 0.5, size));
        expect_fills(shuffled(hollow_ball(2, 0.7, size)));
        expect_fills(hollow_ball(3, 0.95, size));  // a wall of a twentieth
    }
}

TEST(HollowBodies, MayHaveSmallCavitiesAndSeveral) {
    const TriMesh ball = icosphere(2), bubble = icosphere(1);
    expect_fills(joined(ball, moved(bubble, 0.3, 0.1, 0, 0.01)));
    TriMesh holes = moved(bubble, 0.5, 0, 0, 0.2);
    for (const double x : {-0.5, 0.01}) holes = joined(holes, moved(bubble, x, 0.1, 0, 0.2));
    // The cavities come before the shell.
    expect_fills(shuffled(joined(holes, ball)));
    EXPECT_EQ(make_solid_boundary(joined(holes, ball)).report.cavities, 3);
}

TEST(HollowBodies, AreTakenApartIntoShells) {
    const TriMesh solid = make_solid_boundary(shuffled(hollow_ball(3, 0.5))).mesh;
    const std::vector<Shell> shells = shells_of(solid.X, solid.F), cavities = cavities_of(solid.X, solid.F);
    ASSERT_EQ(shells.size(), 2u);
    ASSERT_EQ(cavities.size(), 1u);
    EXPECT_EQ(shells[1].faces, cavities[0].faces);
    EXPECT_NEAR(shells[0].volume, enclosed_volume(icosphere(3)), 1e-12);
    EXPECT_NEAR(shells[1].volume, -enclosed_volume(icosphere(3)) / 8, 1e-12);
    const TriMesh part = part_of(solid.X, solid.F, cavities[0].faces);
    EXPECT_NEAR(enclosed_volume(part), cavities[0].volume, 1e-12);
    // A part with an open edge bounds nothing, and a surface inside out has no cavity.
    const Faces open = solid.F.topRows(solid.F.rows() - 1);
    EXPECT_EQ(shells_of(solid.X, open).size(), 1u);
    EXPECT_TRUE(cavities_of(solid.X, open).empty());
    TriMesh ball = icosphere(1);
    ball.F.col(1).swap(ball.F.col(2));
    EXPECT_TRUE(cavities_of(ball.X, ball.F).empty());
}

TEST(HollowBodies, KeepTheirShellsWhenCoveredAnew) {
    const TriMesh solid = make_solid_boundary(hollow_ball(4, 0.6)).mesh;
    const auto [coarse, report] = make_solid_boundary(remesh(solid, 0.3));
    EXPECT_LT(coarse.F.rows(), solid.F.rows() / 4);
    EXPECT_EQ(report.cavities, 1);
    EXPECT_NEAR(report.volume, enclosed_volume(solid), 1e-6 * report.volume);
    const std::vector<Shell> before = cavities_of(solid.X, solid.F), after = cavities_of(coarse.X, coarse.F);
    EXPECT_NEAR(after.at(0).volume, before.at(0).volume, 1e-6);
    // Triangles with these edges cannot follow a bubble, which keeps its own.
    const TriMesh bubble = icosphere(1);
    const TriMesh bubbly = make_solid_boundary(joined(icosphere(4), moved(bubble, 0.3, 0, 0, 0.01))).mesh;
    const TriMesh covered = remesh(bubbly, 0.4);
    const std::vector<Shell> kept = cavities_of(covered.X, covered.F);
    ASSERT_EQ(kept.size(), 1u);
    EXPECT_EQ(kept[0].faces.size(), static_cast<std::size_t>(bubble.F.rows()));
    EXPECT_NEAR(kept[0].volume, -1e-6 * enclosed_volume(bubble), 1e-12);
}

TEST(HollowBodies, DoNotContainWhatLiesInTheirCavities) {
    const TriMesh hollow = hollow_ball(2, 0.5), bubble = moved(icosphere(1), 0, 0, 0, 0.1);
    for (const TriMesh& outer : {hollow, make_solid_boundary(hollow).mesh}) {
        EXPECT_EQ(containment(bubble, outer), Containment::none);
        EXPECT_EQ(containment(moved(bubble, 0.75, 0, 0), outer), Containment::whole);
        EXPECT_EQ(containment(joined(bubble, moved(bubble, 0.75, 0, 0)), outer), Containment::some_parts);
        EXPECT_EQ(containment(moved(bubble, 2, 0, 0), outer), Containment::none);
    }
}

TEST(HollowBodies, MustBeOneShellThatNoCavityTouches) {
    const TriMesh ball = icosphere(2);
    const auto refusal = [](const TriMesh& mesh) {
        return test::error_of([&] { make_solid_boundary(mesh); });
    };
    // A cavity that ends at the shell: faces of both meet.
    EXPECT_NE(refusal(joined(ball, moved(ball, 0.6, 0, 0, 0.5))).find("intersects itself"),
              std::string::npos);
    EXPECT_NE(refusal(joined(hollow_ball(2, 0.5), moved(ball, 0, 0, 0, 0.2))).find("must be one shell"),
              std::string::npos)
        << "a ball within the cavity";
    EXPECT_NE(refusal(joined(hollow_ball(2, 0.5), moved(ball, 3, 0, 0))).find("(2 shells and 1 cavity;"),
              std::string::npos);
}

}  // namespace
}  // namespace nbd
