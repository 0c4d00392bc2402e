#include "meshing/tets/tet_quality.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace nbd {
namespace {

TetMesh one_tet(std::initializer_list<double> xyz) {
    TetMesh tets;
    tets.X = Eigen::Map<const Nodes>(xyz.begin(), 4, 3);
    tets.T.resize(1, 4);
    tets.T << 0, 1, 2, 3;
    return tets;
}

TEST(TetQuality, IsOneForARegularTetrahedron) {
    const TetQuality q = tet_quality(one_tet({1, 1, 1, -1, 1, -1, 1, -1, -1, -1, -1, 1}));
    EXPECT_NEAR(q.radius_ratio_min, 1, 1e-14);
    EXPECT_NEAR(q.dihedral_min, std::acos(1. / 3) * 180 / M_PI, 1e-12);
    EXPECT_NEAR(q.dihedral_max, q.dihedral_min, 1e-12);
    EXPECT_NEAR(q.volume, 8. / 3, 1e-14);
    EXPECT_EQ(q.radius_ratio_histogram[9], 1);
}

TEST(TetQuality, MatchesTheClosedFormForTheCornerOfACube) {
    const TetQuality q = tet_quality(one_tet({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}));
    const double r = 1 / (3 + std::sqrt(3.)), R = std::sqrt(3.) / 2;
    EXPECT_NEAR(q.radius_ratio_mean, 3 * r / R, 1e-14);
    EXPECT_NEAR(q.dihedral_max, 90, 1e-12);
    EXPECT_NEAR(q.dihedral_min, std::acos(1 / std::sqrt(3.)) * 180 / M_PI, 1e-12);
    EXPECT_NEAR(q.volume_min, 1. / 6, 1e-15);
}

TEST(TetQuality, DistinguishesFlatAndInvertedTetrahedra) {
    EXPECT_EQ(tet_quality(one_tet({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0})).radius_ratio_min, 0);
    const TetQuality q = tet_quality(one_tet({0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1}));
    EXPECT_LT(q.radius_ratio_min, 0);
    EXPECT_LT(q.volume_min, 0);
    EXPECT_EQ(q.worst_tet, 0);
}

TEST(TetQuality, DoesNotDependOnSize) {
    const auto at = [](double h) {
        return tet_quality(one_tet({0, 0, 0, h, 0, 0, 0, 2 * h, 0, 0, 0, 3 * h}));
    };
    EXPECT_NEAR(at(1e-6).radius_ratio_min, at(1e6).radius_ratio_min, 1e-12);
    EXPECT_NEAR(at(1e-6).dihedral_min, at(1e6).dihedral_min, 1e-9);
}

TEST(TetQuality, IsPrintedAsATable) {
    const std::string text = to_text(tet_quality(one_tet({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1})));
    EXPECT_NE(text.find("tetrahedra              1\n"), std::string::npos) << text;
    EXPECT_NE(text.find("dihedral angles         54.7 .. 90.0 degrees\n"), std::string::npos) << text;
}

}  // namespace
}  // namespace nbd
