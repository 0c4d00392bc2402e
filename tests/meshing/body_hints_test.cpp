#include "meshing/body/body_hints.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "meshing/body/make_body.hpp"
#include "meshing/tets/tetrahedralize.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

using testing::HasSubstr;

TetMesh filled(const TriMesh& surface) { return tetrahedralize(surface, {}).tets; }

TEST(BodyHints, TellsOfPartsThatAreOneTetrahedronThick) {
    const std::string thin = "is one tetrahedron thick in 100 % of its volume";
    EXPECT_THAT(thin_hint(test::box_mesh({1, 0.1, 0.1}, {10, 1, 1})), HasSubstr(thin));
    EXPECT_THAT(thin_hint(test::box_mesh({1, 1, 0.05}, {20, 20, 1})), HasSubstr(thin));
    EXPECT_THAT(thin_hint(filled(test::box(1, 0.1, 0.1, 1))), HasSubstr(thin)) << "CAD's twelve triangles";
    // gmsh adds a few nodes inside.
    EXPECT_THAT(thin_hint(filled(test::box(1, 0.1, 0.1, 2))), HasSubstr("is one tetrahedron thick in 8"));
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
        EXPECT_EQ(locking_hint(material, {}), "") << ratio;
    }
    material.poisson = 0.49;
    const std::string hint = locking_hint(material, {});
    EXPECT_THAT(hint, HasSubstr("has a Poisson's ratio of 0.49, at which its tetrahedra lock"));
    material.poisson = 0.3;
    MaterialRegion region{.name = "core", .material = {.poisson = 0.499}, .tets = {0}};
    EXPECT_THAT(locking_hint(material, {region}), HasSubstr("ratio of 0.499"));
}

}  // namespace
}  // namespace nbd
