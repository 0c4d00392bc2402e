#include "collision/nbd_tree/fixed_point.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/collision/models.hpp"

namespace nbd {
namespace {

Eigen::MatrixXf random_matrix(Eigen::Index rows, Eigen::Index cols, unsigned seed) {
    std::mt19937 random(seed);
    return Eigen::MatrixXf::NullaryExpr(rows, cols, [&](Eigen::Index, Eigen::Index) {
        return shapes::uniform(random) * shapes::uniform(random);
    });
}

TEST(FixedVector, KeepsFourteenBitsRelativeToTheLargestEntry) {
    for (const float size : {1.f, 1e-20f, 3e30f}) {
        const Eigen::VectorXf x = size * random_matrix(37, 1, 1);
        const FixedVector fixed = shapes::fixed(x);
        const float largest = x.cwiseAbs().maxCoeff();
        EXPECT_EQ(std::exp2(std::rint(std::log2(fixed.scale()))), fixed.scale());
        for (int i = 0; i < 37; ++i)
            EXPECT_LE(std::abs(fixed.scale() * fixed.fixed()[i] - x[i]), largest / 16384);
        for (int i = 37; i < 64; ++i) EXPECT_EQ(fixed.fixed()[i], 0);
    }
}

TEST(FixedVector, HasScaleZeroForTinyEntriesAndNanForNonFiniteOnes) {
    const FixedVector tiny = shapes::fixed(Eigen::VectorXf::Constant(3, 1e-38f));
    EXPECT_EQ(tiny.scale(), 0);
    for (const float bad : {NAN, INFINITY, -INFINITY}) {
        const FixedVector none = shapes::fixed(Eigen::Vector3f(1, bad, 2));
        EXPECT_TRUE(std::isnan(none.scale()));
        for (int i = 0; i < 32; ++i) EXPECT_EQ(none.fixed()[i], 0);
    }
}

TEST(FixedMatrix, RoundsOnlyOnce) {
    const Eigen::MatrixXf M = random_matrix(45, 6, 2) * Eigen::VectorXf::LinSpaced(6, 1e-3f, 7).asDiagonal();
    const FixedMatrix fixed(M);
    for (int c = 0; c < 6; ++c)
        EXPECT_LE((fixed.numbers().col(c) - M.col(c)).cwiseAbs().maxCoeff(),
                  M.col(c).cwiseAbs().maxCoeff() / 8192);
    EXPECT_EQ(FixedMatrix(fixed.numbers()), fixed);
    EXPECT_EQ(FixedMatrix(fixed.numbers()).numbers(), fixed.numbers());
}

TEST(FixedMatrix, ReportsNonFiniteEntries) {
    Eigen::MatrixXf M = random_matrix(5, 3, 2);
    EXPECT_TRUE(FixedMatrix(M).all_finite());
    const FixedMatrix finite(M);
    M(4, 1) = INFINITY;
    EXPECT_FALSE(FixedMatrix(M).all_finite());
    EXPECT_EQ(FixedMatrix(M).numbers().col(2), finite.numbers().col(2));
}

TEST(FixedMatrix, ProductsAgreeWithItsRoundedEntries) {
    for (const int rows : {1, 31, 32, 33, 500})
        for (const int cols : {1, 2, 3, 4, 7, 12}) {
            const FixedMatrix M(random_matrix(rows, cols, 3));
            const FixedVector x = shapes::fixed(random_matrix(rows, 1, 4));
            const Eigen::VectorXd rounded =
                static_cast<double>(x.scale()) *
                Eigen::Map<const Eigen::Vector<std::int16_t, Eigen::Dynamic>>(x.fixed(), rows).cast<double>();
            const Eigen::VectorXd expected = M.numbers().transpose().cast<double>() * rounded;
            Eigen::VectorXf y(cols);
            M.transposed_times(x, y);
            EXPECT_LE((y.cast<double>() - expected).norm(), 1e-6 * (expected.norm() + 1))
                << rows << ' ' << cols;
        }
}

}  // namespace
}  // namespace nbd
