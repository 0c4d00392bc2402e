#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "sim/fem/elastic_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

std::string refusal(const TetMesh& mesh, const Material& material,
                    const std::vector<MaterialRegion>& regions = {}) {
    return test::refusal([&] { ElasticBody(mesh, material, MassKind::lumped, regions); });
}

TEST(ElasticBody, RejectsInvalidRegions) {
    const TetMesh box = test::box_mesh({1, 1, 1}, {1, 1, 1});
    const Material material;
    EXPECT_EQ(refusal(box, material, {{.name = "a", .material = material, .tets = {0, 6}}}),
              "region \"a\": it has tetrahedron 6; allowed: 0 to 5");
    EXPECT_EQ(refusal(box, material,
                      {{.name = "a", .material = material, .tets = {0, 1}},
                       {.name = "b", .material = material, .tets = {1}}}),
              "region \"b\": tetrahedron 1 is in a region already; allowed: one each");
    EXPECT_EQ(refusal(box, material,
                      {{.name = "a", .material = material, .tets = {0}},
                       {.name = "a", .material = material, .tets = {1}}}),
              "region \"a\": its name is empty or taken; allowed: a name of its own");
    EXPECT_EQ(refusal(box, material, {{.name = "a", .material = {.rayleigh_mass = 7}, .tets = {0}}}),
              "region \"a\": its damping differs; allowed: that of the body");
    EXPECT_EQ(refusal(box, material, {{.name = "a", .material = {.poisson = 0.6}, .tets = {0}}}),
              "region \"a\": Poisson's ratio is 0.6; allowed: between -0.999 and 0.499");
    EXPECT_EQ(refusal(box, material, {{.name = "a", .material = material, .tets = {}}}),
              "region \"a\": it has no tetrahedra; allowed: at least one");
}

TEST(ElasticBody, RejectsInvalidMaterials) {
    const TetMesh box = test::box_mesh({1, 1, 1}, {1, 1, 1});
    EXPECT_EQ(refusal(box, {.young = 0}), "Young's modulus is 0; allowed: between 1e-30 and 1e30 Pa");
    EXPECT_EQ(refusal(box, {.young = std::numeric_limits<double>::infinity()}),
              "Young's modulus is inf; allowed: between 1e-30 and 1e30 Pa");
    EXPECT_EQ(refusal(box, {.young = 1e300}),
              "Young's modulus is 1e+300; allowed: between 1e-30 and 1e30 Pa");
    EXPECT_EQ(refusal(box, {.poisson = 0.5}), "Poisson's ratio is 0.5; allowed: between -0.999 and 0.499");
    EXPECT_EQ(refusal(box, {.poisson = -1}), "Poisson's ratio is -1; allowed: between -0.999 and 0.499");
    EXPECT_EQ(refusal(box, {.density = -2}), "density is -2; allowed: between 1e-30 and 1e30 kg/m3");
    EXPECT_EQ(refusal(box, {.rayleigh_mass = -1}),
              "Rayleigh mass damping is -1; allowed: between 0 and 1e30 1/s");
    EXPECT_EQ(refusal(box, {.rayleigh_stiffness = std::nan("")}),
              "Rayleigh stiffness damping is nan; allowed: between 0 and 1e30 s");
}

TEST(ElasticBody, RejectsInvalidMeshes) {
    const TetMesh box = test::box_mesh({1, 1, 1}, {1, 1, 1});
    TetMesh bad = box;
    bad.T(2, 1) = 8;
    EXPECT_EQ(refusal(bad, {}), "tetrahedron 2 refers to node 8, but the mesh has 8 nodes");
    bad = box;
    bad.T(3, 0) = -1;
    EXPECT_EQ(refusal(bad, {}), "tetrahedron 3 refers to node -1, but the mesh has 8 nodes");
    bad = box;
    std::swap(bad.T(4, 0), bad.T(4, 1));
    EXPECT_EQ(refusal(bad, {}).substr(0, 26), "tetrahedron 4 has volume -");
    bad = box;
    bad.X(5, 1) = std::nan("");
    EXPECT_EQ(refusal(bad, {}), "node 5 lies at (1 nan 1); allowed: finite positions");
    bad = box;
    bad.X = Nodes::Zero(9, 3);
    bad.X.topRows(8) = box.X;
    EXPECT_EQ(refusal(bad, {}), "node 8 belongs to no tetrahedron");
    bad.T.resize(0, 4);
    EXPECT_EQ(refusal(bad, {}), "elastic body: no tetrahedra; allowed: at least one");
}

}  // namespace
}  // namespace nbd
