// Compares with an independent FEM program on the same tetrahedra, if installed.
#include "tests/sim/calculix/calculix.hpp"

#include <gtest/gtest.h>

#include "meshing/body/make_body.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd::test {
namespace {

class CalculiX : public ::testing::Test {
 protected:
    void SetUp() override {
        if (!calculix_installed()) GTEST_SKIP() << "ccx is not installed (Debian: calculix-ccx)";
    }
    const Body beam = box_body({1, 0.2, 0.15}, {16, 3, 3}, {.young = 2e5, .poisson = 0.35});
    const Body quadratic_beam = make_body("beam", make_quadratic(box_mesh({1, 0.2, 0.15}, {8, 2, 2})),
                                          {.young = 2e5, .poisson = 0.3});
};

TEST_F(CalculiX, AgreesOnFrequenciesOfQuadraticElements) {
    const auto rows = compare_frequencies(quadratic_beam);
    ASSERT_EQ(rows.size(), 20u);
    for (const Comparison& row : rows) EXPECT_LT(row.difference, 1e-5) << row.quantity;
}

TEST_F(CalculiX, AgreesOnDeflectionsOfQuadraticElements) {
    for (const Comparison& row : compare_deflections(quadratic_beam)) {
        EXPECT_LT(row.difference, 1e-4) << row.quantity;
        EXPECT_GT(row.theirs, 1e-6) << row.quantity;
    }
    const Comparison row = compare_large_deflection(quadratic_beam, MaterialLaw::st_venant_kirchhoff);
    EXPECT_GT(row.theirs, 0.15);
    EXPECT_LT(row.difference, 1e-5);
}

TEST_F(CalculiX, AgreesOnFrequencies) {
    const auto rows = compare_frequencies(beam);
    ASSERT_EQ(rows.size(), 20u);
    for (const Comparison& row : rows) EXPECT_LT(row.difference, 1e-5) << row.quantity;
}

TEST_F(CalculiX, AgreesOnSmallDeflections) {
    for (const Comparison& row : compare_deflections(beam)) {
        EXPECT_LT(row.difference, 1e-4) << row.quantity;
        EXPECT_GT(row.theirs, 1e-6) << row.quantity;
    }
}

// Different strain measures agree only approximately.
TEST_F(CalculiX, NearlyAgreesOnLargeDeflections) {
    const Comparison row = compare_large_deflection(beam, MaterialLaw::corotated);
    EXPECT_GT(row.theirs, 0.15);
    EXPECT_LT(row.difference, 0.01);
}

TEST_F(CalculiX, AgreesOnLargeDeflectionsOfStVenantKirchhoff) {
    const Comparison row = compare_large_deflection(beam, MaterialLaw::st_venant_kirchhoff);
    EXPECT_GT(row.theirs, 0.15);
    EXPECT_LT(row.difference, 1e-5);
}

TEST_F(CalculiX, AgreesOnStaticIncrements) {
    const auto rows = compare_static_increments();
    ASSERT_EQ(rows.size(), 3u);
    for (const Comparison& row : rows) {
        EXPECT_LT(row.difference, 1e-5) << row.quantity;
        EXPECT_GT(row.theirs, 0.04) << row.quantity;
    }
}

}  // namespace
}  // namespace nbd::test
