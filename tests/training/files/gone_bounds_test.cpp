// Tests that trees with bounds that are gone are read without them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "collision/base/notice.hpp"
#include "collision/flat/flat_tree.hpp"
#include "tests/support/edit_file.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {
namespace {

std::vector<std::string> told;

class GoneBoundsTest : public test::FileTest {
 protected:
    GoneBoundsTest() {
        told.clear();
        set_notice_handler([](std::string_view line) { told.emplace_back(line); });
    }
    ~GoneBoundsTest() override { set_notice_handler(nullptr); }

    const std::filesystem::path release = std::filesystem::path(NBD_ASSETS) / "release_0.2";
};

TEST_F(GoneBoundsTest, AreLeftOutOfATreeWithANotice) {
    const TreeFile file = load_tree(release / "tree.h5");
    const CollisionTree flat = load_flat_tree(release / "tree.nbd");
    const std::string certified =
        "its certified bounds are gone and were left out; use affine, which miss nothing either and need no "
        "training";
    const std::string learned =
        "its learned_spheres and learned_boxes bounds are gone and were left out; use learned_affine, which "
        "`nbdtree train` makes";
    const std::string path = (release / "tree.h5").string() + ": ", a_flat_tree = "a flat tree: ";
    EXPECT_EQ(told, (std::vector{path + certified, path + learned, a_flat_tree + certified,
                                 a_flat_tree + learned}));
    for (const CollisionTree& tree : {file.tree, flat})
        for (const BoundKind kind : bound_kinds) EXPECT_TRUE(is_usable(tree, kind, {})) << name(kind);
    EXPECT_EQ(write_flat_tree(file.tree), write_flat_tree(flat));
    told.clear();
    save_tree(folder / "again.h5", file);
    save_flat_tree(folder / "again.nbd", flat);
    load_tree(folder / "again.h5");
    load_flat_tree(folder / "again.nbd");
    EXPECT_TRUE(told.empty());
}

TEST_F(GoneBoundsTest, LeaveTheNodesAtRestToAffineBounds) {
    const AffineModel affine = *load_tree(release / "tree.h5").tree.affine;
    std::filesystem::copy_file(release / "tree.h5", folder / "tree.h5");
    test::EditFile(folder / "tree.h5").remove("affine");
    const TreeFile file = load_tree(folder / "tree.h5");
    ASSERT_TRUE(file.tree.affine);
    EXPECT_EQ(file.tree.affine->rest(), affine.rest());
}

TEST_F(GoneBoundsTest, AreNotAllThatATreeMayHold) {
    std::filesystem::copy_file(release / "tree.h5", folder / "tree.h5");
    {
        test::EditFile edit(folder / "tree.h5");
        for (const char* group : {"nbd", "bd", "learned", "learned_affine", "affine", "calibration", "solid"})
            edit.remove(group);
    }
    EXPECT_EQ(
        test::error_of([&] { load_tree(folder / "tree.h5"); }),
        (folder / "tree.h5").string() +
            ": holds no bounds but ones that are gone; train the tree anew, or use the body without a tree");
}

TEST(GoneBounds, SayWhatToWriteInstead) {
    for (const auto& [gone, instead] :
         {std::pair("certified", "affine"), std::pair("learned_spheres", "learned_affine"),
          std::pair("learned_boxes", "learned_affine"), std::pair("modal", "nbd")})
        EXPECT_EQ(test::error_of<std::invalid_argument>([&] { bound_kind(gone); }),
                  fmt::format("bounds \"{}\" are gone; write \"{}\"", gone, instead));
    EXPECT_EQ(instead_of_bound("nbd"), "");
    EXPECT_EQ(bound_kind("nbd"), BoundKind::nbd);
}

}  // namespace
}  // namespace nbd
