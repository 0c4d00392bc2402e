#include <gtest/gtest.h>

#include <cmath>

#include "collision/nbd_tree/bd_bound.hpp"
#include "tests/collision/models.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

struct BdModelTest : testing::Test {
    shapes::Surface s = shapes::sphere(6, 8);  // 50 vertices
    SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = 1});
    shapes::Modes modes = shapes::make_modes(s, 4, 20, 1);
};

TEST_F(BdModelTest, RecoversTheModalCoordinatesOfAPoseInTheSpanOfTheModes) {
    const BdModel model = build_bd_model(tree, modes.U, modes.clustered);
    ModalCoordinatesScratch scratch;
    Eigen::VectorXf z(4);
    const Eigen::VectorXf q = Eigen::Vector4f(0.1f, -0.2f, 0.05f, 0.15f);
    modal_coordinates(modes.clustered, shapes::nbd_pose(s, modes.U, q), scratch, z);
    EXPECT_NEAR((model.z_to_q * z - q).norm(), 0, 1e-5);
}

TEST_F(BdModelTest, RejectsModesOfTheWrongShapeOrNotFinite) {
    EXPECT_EQ(test::refusal([&] { build_bd_model(tree, modes.U.topRows(147), modes.clustered); }),
              "BD-Tree: U has 147 rows, the tree's vertex 49 needs 150");
    EXPECT_EQ(test::refusal([&] { build_bd_model(tree, modes.U.leftCols(3), modes.clustered); }),
              "BD-Tree: U has 3 modes, the clustered modes have 4");
    Eigen::MatrixXf U = modes.U;
    U.conservativeResize(151, 4);
    EXPECT_EQ(test::refusal([&] { build_bd_model(tree, U, modes.clustered); }),
              "BD-Tree: U has 151 rows, allowed: 3 per vertex");
    U = modes.U;
    U(7, 1) = NAN;
    EXPECT_EQ(test::refusal([&] { build_bd_model(tree, U, modes.clustered); }),
              "BD-Tree: an entry of U is not finite");
    ClusteredModes clustered = modes.clustered;
    clustered.w[3] = 0;
    EXPECT_EQ(test::refusal([&] { build_bd_model(tree, modes.U, clustered); }),
              "modes: weight 3 is 0, allowed: finite and above 0");
}

TEST_F(BdModelTest, RejectsLinearlyDependentModesInAnyUnits) {
    ClusteredModes clustered = modes.clustered;
    Eigen::MatrixXf U = clustered.U.numbers();
    U.col(2) = 0.125f * U.col(0);  // exact in fixed point
    clustered.U = FixedMatrix(U);
    EXPECT_NE(test::refusal([&] {
                  build_bd_model(tree, modes.U, clustered);
              }).find("linearly dependent at the representatives (4 modes, 20 representatives"),
              std::string::npos);
    U.col(2).setZero();
    clustered.U = FixedMatrix(U);
    EXPECT_EQ(test::refusal([&] { build_bd_model(tree, modes.U, clustered); }),
              "BD-Tree: mode 2 is zero at all representatives");
    U.col(2) = 1e-9f * modes.clustered.U.numbers().col(2);
    clustered.U = FixedMatrix(U);
    EXPECT_EQ(test::refusal([&] { build_bd_model(tree, modes.U, clustered); }), "");
}

TEST_F(BdModelTest, CheckReportsEachKindOfInvalidModel) {
    const BdModel whole = build_bd_model(tree, modes.U, modes.clustered);
    const auto error = [&](auto tamper) {
        BdModel model = whole;
        tamper(model);
        return test::refusal([&] { check_bd_model(model, tree, 50); });
    };
    using M = BdModel;
    EXPECT_EQ(error([](M&) {}), "");
    EXPECT_EQ(error([](M& m) { m.modes.representatives.pop_back(); }),
              "modes: 19 representatives, but 20 weights, 20 rest positions and 60 rows of U instead of 57");
    EXPECT_EQ(error([](M& m) { m.z_to_q.conservativeResize(4, 3); }),
              "BD-Tree: z_to_q is 4 x 3 instead of 4 x 4");
    EXPECT_EQ(error([](M& m) { m.Ubar.conservativeResize(4, 8); }),
              "BD-Tree: Ubar is 4 x 8 instead of 4 x 9");
    EXPECT_EQ(error([](M& m) { m.dr.conservativeResize(3, 3); }), "BD-Tree: dr is 3 x 3 instead of 4 x 3");
    EXPECT_EQ(error([](M& m) { m.dr(1, 1) = NAN; }), "BD-Tree: an entry of dr is not finite");
    EXPECT_EQ(error([](M& m) { m.dr(1, 1) = -1; }), "BD-Tree: an entry of dr is negative");
    EXPECT_EQ(error([](M& m) { m.Ubar(1, 1) = INFINITY; }), "BD-Tree: an entry of Ubar is not finite");
}

}  // namespace
}  // namespace nbd
