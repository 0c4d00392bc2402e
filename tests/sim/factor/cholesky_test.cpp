#include "sim/factor/cholesky.hpp"

#include <gtest/gtest.h>

#include "sim/factor/blas.hpp"
#include "sim/fem/elastic_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

class CholeskyOfABar : public ::testing::Test {
 protected:
    CholeskyOfABar() : body(test::box_mesh({1, 1, 1}, {5, 4, 3}, 0.2), Material{}) {
        body.pose(body.rest().X, pose, forces);
        A = matrix(1e-4);
        b = Eigen::VectorXd::LinSpaced(body.unknown_count(), -1, 2);
    }
    SparseMatrix matrix(double stiffness) const {
        StepMatrix result = body.zero_matrix();
        body.combine(1, stiffness, pose, result);
        return result.to_sparse();
    }
    ElasticBody body;
    ElementPose pose;
    ElementForces forces;
    SparseMatrix A;
    Eigen::VectorXd b;
};

std::string failure(Cholesky& cholesky, const SparseMatrix& A) {
    return test::error_of([&] { cholesky.factorize(A); });
}

TEST_F(CholeskyOfABar, SolvesForDifferentValuesOfOnePattern) {
    Cholesky cholesky;
    cholesky.analyze(A);
    for (const double stiffness : {1e-4, 1e-2, 1.0}) {
        A = matrix(stiffness);
        cholesky.factorize(A);
        Eigen::VectorXd x(b.size());
        cholesky.solve(b, x);
        EXPECT_LT((A * x - b).norm(), 1e-12 * A.norm() * x.norm());
        Eigen::VectorXd in_place = b;
        cholesky.solve(in_place, in_place);
        EXPECT_EQ(in_place, x);
    }
    EXPECT_GT(cholesky.factor_entries(), A.nonZeros() / 2);
}

TEST_F(CholeskyOfABar, ReportsAnIndefiniteMatrixAndRecovers) {
    Cholesky cholesky;
    cholesky.analyze(A);
    SparseMatrix bad = A;
    bad.coeffRef(3 * 17 + 1, 3 * 17 + 1) = -5;
    const std::string text = failure(cholesky, bad);
    EXPECT_EQ(text.substr(0, 61), "factorize: the matrix is not positive definite (pivot of node");
    EXPECT_FALSE(cholesky.factorized());
    EXPECT_THROW(cholesky.solve(b, b), std::logic_error);
    bad.coeffRef(4, 4) = std::nan("");
    EXPECT_EQ(failure(cholesky, bad), "factorize: the matrix holds a NaN or an infinity");
    EXPECT_EQ(failure(cholesky, A), "");
}

TEST_F(CholeskyOfABar, RejectsAnotherPattern) {
    Cholesky cholesky;
    EXPECT_EQ(failure(cholesky, A).substr(0, 24), "factorize: matrix has 36");
    cholesky.analyze(A);
    const ElasticBody other(test::box_mesh({1, 1, 1}, {2, 2, 2}), Material{});
    EXPECT_EQ(failure(cholesky, other.pattern().zero_matrix()).substr(0, 24), "factorize: matrix has 81");
}

TEST(Blas, WarnsInOneLineUnlessAFastLibraryIsLoaded) {
    const BlasInfo info = blas_info();
    EXPECT_FALSE(info.name.empty());
    EXPECT_EQ(info.fast, info.warning.empty());
    EXPECT_EQ(info.warning.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace nbd
