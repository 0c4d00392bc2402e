#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "collision/base/notice.hpp"
#include "collision/flat/flat_tree.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {
namespace {

std::vector<std::string> notices;

class OldFiles : public ::testing::Test {
 protected:
    void SetUp() override {
        notices.clear();
        set_notice_handler([](std::string_view line) { notices.emplace_back(line); });
    }
    void TearDown() override { set_notice_handler(nullptr); }

    const std::filesystem::path folder = std::filesystem::path(NBD_ASSETS) / "release_0.1";
};

TEST_F(OldFiles, TreesOfRelease01LoadWholeWithANotice) {
    const TreeFile file = load_tree(folder / "tree.h5");
    ASSERT_EQ(notices.size(), 1u);
    EXPECT_NE(notices[0].find("tree.h5: this tree file is from release 0.1"), std::string::npos)
        << notices[0];
    ASSERT_TRUE(file.tree.nbd && file.tree.learned && file.tree.bd && file.tree.certified);
    EXPECT_GT(file.tree.nbd->z_mean.size(), 0);
    EXPECT_GT(file.facts.z_error, 0);
    for (const BoundKind kind : {BoundKind::nbd, BoundKind::learned_spheres, BoundKind::learned_boxes})
        EXPECT_TRUE(file.tree.calibrations.contains(kind)) << name(kind);
}

TEST_F(OldFiles, FlatTreesOfRelease01HoldTheSameTree) {
    const CollisionTree flat = load_flat_tree(folder / "tree.nbd");
    ASSERT_EQ(notices.size(), 1u);
    EXPECT_NE(notices[0].find("flat tree is from release 0.1"), std::string::npos) << notices[0];
    EXPECT_EQ(write_flat_tree(flat), write_flat_tree(load_tree(folder / "tree.h5").tree));
}

TEST_F(OldFiles, OldNamesOfBoundsGiveTodaysKindsWithANotice) {
    EXPECT_EQ(bound_kind("modal"), BoundKind::nbd);
    EXPECT_EQ(bound_kind("local"), BoundKind::learned_spheres);
    EXPECT_EQ(bound_kind("local_boxes"), BoundKind::learned_boxes);
    EXPECT_EQ(notices.size(), 3u);
    EXPECT_EQ(bound_kind("nbd"), BoundKind::nbd);
    EXPECT_EQ(notices.size(), 3u);
}

}  // namespace
}  // namespace nbd
