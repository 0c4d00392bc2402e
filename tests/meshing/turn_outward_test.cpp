
#include <gtest/gtest.h>

#include "meshing/surface/solid_boundary.hpp"
#include "tests/meshing/shapes.hpp"

namespace nbd {
namespace {

using namespace test;

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

}  // namespace
}  // namespace nbd
