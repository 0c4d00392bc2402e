#include "sim/fem/bending_error.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "meshing/body/make_body.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/fem/elastic_body.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

Body bar(const Eigen::Vector3i& cells, bool quadratic, double poisson, const Eigen::Vector3d& size) {
    TetMesh mesh = test::box_mesh(size, cells);
    if (quadratic) mesh = make_quadratic(std::move(mesh));
    return make_body("bar", std::move(mesh), {.poisson = poisson});
}

double error_of(const Eigen::Vector3i& cells, bool quadratic, double poisson,
                const Eigen::Vector3d& size = {1, 0.1, 0.09}) {
    return bending_error(bar(cells, quadratic, poisson, size), 200'000).value();
}

/// Very fine quadratic tetrahedra miss nearly nothing; what coarser ones miss is told by less fine ones.
TEST(BendingError, IsWhatLinearTetrahedraMiss) {
    EXPECT_GT(error_of({10, 1, 1}, false, 0.3), 0.5);
    EXPECT_GT(error_of({20, 2, 2}, false, 0.3), 0.25);
    EXPECT_GT(error_of({20, 2, 2}, false, 0.499), 0.8);
    EXPECT_LT(error_of({40, 4, 4}, false, 0.0), 0.25);
}

TEST(BendingError, FallsAsQuadraticTetrahedraBecomeFiner) {
    const double coarse = error_of({5, 1, 1}, true, 0.3), middle = error_of({10, 1, 1}, true, 0.3),
                 fine = error_of({20, 2, 2}, true, 0.3);
    EXPECT_LT(coarse, 0.25);
    EXPECT_LT(middle, 0.6 * coarse);
    EXPECT_LT(fine, 0.5 * middle);
    EXPECT_GT(fine, 0);
}

TEST(BendingError, DoesNotDependOnSizeOrStiffness) {
    const double here = error_of({5, 1, 1}, true, 0.3);
    for (const double size : {1e-3, 1e3})
        EXPECT_NEAR(error_of({5, 1, 1}, true, 0.3, size * Eigen::Vector3d(1, 0.1, 0.09)), here, 1e-6) << size;
    Body stiff = bar({5, 1, 1}, true, 0.3, {1, 0.1, 0.09});
    stiff.material.young = 1e11;
    EXPECT_NEAR(bending_error(stiff).value(), here, 1e-6);
}

/// Half of a bar is so stiff that the other half alone bends.
TEST(BendingError, TakesTheMaterialsOfRegions) {
    Body body = bar({10, 1, 1}, true, 0.3, {1, 0.1, 0.09});
    const double plain = bending_error(body).value();
    MaterialRegion stiff{.name = "stiff", .material = body.material, .tets = {}};
    stiff.material.young *= 1e4;
    for (int t = 0; t < body.tets.T.rows(); ++t)
        if (body.tets.X(body.tets.T.row(t), 0).mean() < 0.5) stiff.tets.push_back(t);
    body.regions = {stiff};
    EXPECT_GT(std::abs(bending_error(body).value() - plain), 0.05 * plain);
}

TEST(BendingError, IsNotKnownOfLargeBodiesAndOfThoseInParts) {
    EXPECT_FALSE(bending_error(bar({10, 2, 2}, true, 0.3, {1, 0.1, 0.09}), 8 * 239));
    EXPECT_TRUE(bending_error(bar({10, 2, 2}, true, 0.3, {1, 0.1, 0.09}), 8 * 240));
    EXPECT_GT(bending_error(bar({1, 1, 1}, false, 0.3, {1, 0.1, 0.09})).value(), 0.9) << "the coarsest";
    Body two = bar({10, 1, 1}, false, 0.3, {1, 0.1, 0.09});
    const TetMesh one = two.tets;
    two.tets.X.conservativeResize(2 * one.X.rows(), 3);
    two.tets.X.bottomRows(one.X.rows()) = one.X.rowwise() + Eigen::RowVector3d(2, 0, 0);
    two.tets.T.conservativeResize(2 * one.T.rows(), 4);
    two.tets.T.bottomRows(one.T.rows()) = one.T.array() + static_cast<int>(one.X.rows());
    EXPECT_FALSE(bending_error(two)) << "its other part floats";
}

}  // namespace
}  // namespace nbd
