#include <gtest/gtest.h>

#include <filesystem>

#include "meshing/tet_quality.hpp"
#include "meshing/tetrahedralize.hpp"
#include "tests/meshing/small_obj.hpp"

namespace nbd {
namespace {

class Asset : public testing::TestWithParam<const char*> {
 protected:
    std::filesystem::path path() const {
        return std::filesystem::path(NBD_ASSETS) / (std::string(GetParam()) + ".obj");
    }
};

TEST_P(Asset, IsSmallCentredAndOneLong) {
    EXPECT_LT(std::filesystem::file_size(path()), 300'000u);
    const TriMesh surface = read_small_obj(path());
    const Eigen::RowVector3d low = surface.X.colwise().minCoeff(), high = surface.X.colwise().maxCoeff();
    EXPECT_NEAR((high - low).maxCoeff(), 1, 1e-5);
    EXPECT_NEAR((high + low).norm(), 0, 1e-5);
}

TEST_P(Asset, IsFilledWithGoodTetrahedra) {
    const TriMesh surface = read_small_obj(path());
    const TetMesh tets = tetrahedralize(surface).tets;
    const TetQuality quality = tet_quality(tets);
    EXPECT_GT(quality.nodes, 500);
    EXPECT_LT(quality.nodes, 3500);
    EXPECT_GT(quality.radius_ratio_min, 0.15) << to_text(quality);
    EXPECT_GT(quality.radius_ratio_mean, 0.7) << to_text(quality);
    EXPECT_GT(quality.dihedral_min, 8) << to_text(quality);
}

INSTANTIATE_TEST_SUITE_P(All, Asset, testing::Values("gecko", "gear", "ring", "beam"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace nbd
