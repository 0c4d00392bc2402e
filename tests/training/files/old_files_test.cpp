#include <gtest/gtest.h>

#include <string>

#include "meshing/h5/writer.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {
namespace {

using OldFiles = test::FileTest;

TEST_F(OldFiles, TreesOfVersion1SayWhatToDoInstead) {
    h5::Writer(folder / "tree.h5", {"nbdtree tree", 1}).commit();
    EXPECT_EQ(test::error_of<std::runtime_error>([&] { load_tree(folder / "tree.h5"); }),
              (folder / "tree.h5").string() +
                  ": is a tree of version 1; allowed: version 2; train the tree again with `nbdtree train`");
}

TEST_F(OldFiles, OldNamesOfBoundsSayWhatToWriteInstead) {
    EXPECT_EQ(test::error_of<std::invalid_argument>([] { bound_kind("modal"); }),
              "bounds \"modal\" are gone; write \"nbd\"");
    EXPECT_EQ(instead_of_bound("nbd"), "");
    EXPECT_EQ(bound_kind("nbd"), BoundKind::nbd);
}

}  // namespace
}  // namespace nbd
