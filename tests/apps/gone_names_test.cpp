#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/apps/command.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

/// Names that are gone are errors of one line, which says what to do instead.
TEST(GoneNames, OfCommandsAndOptionsSayWhatToDoInstead) {
    const test::TemporaryFolder folder;
    const auto refused = [&](const std::vector<std::string>& arguments, const std::string& line) {
        const test::Ran ran = test::run(folder / "", arguments);
        EXPECT_EQ(ran.status, 2);
        EXPECT_EQ(ran.err, "nbdtree: error: `nbdtree " + line + "\n");
        EXPECT_EQ(ran.out, "");
    };
    refused({"trust", "--help"}, "trust` is gone: use `nbdtree coverage`");
    refused({"-q", "carry", "a.h5"}, "carry` is gone: use `nbdtree remap`");
    refused({"bench", "peers"}, "bench` is gone: run the program `nbdtree-bench`");
    refused({"train", "a.h5", "--local-samples=16"},
            "train --local-samples` is gone: leave it out; learned_affine bounds have no samples");
    refused({"train", "a.h5", "b.h5", "-o", "c.h5", "--radius-network", "16"},
            "train --radius-network` is gone: leave it out; learned_affine bounds have no network");
    refused({"dataset", "a.h5", "-o", "b.h5", "--solver", "direct"},
            "dataset --solver` is gone: leave it out; steps are always solved by iteration");
    refused({"export", "tree.h5", "--torch", "a.h5"},
            "export --torch` is gone: tree files hold the networks as plain arrays, in nbd/ "
            "(apps/docs/formats.md)");
}

TEST(GoneNames, OfBoundsSayWhatToWriteInstead) {
    const test::TemporaryFolder folder;
    const test::Ran ran = test::run(folder / "", {"evaluate", "a.h5", "b.h5", "--bounds", "modal"});
    EXPECT_EQ(ran.status, 2);
    EXPECT_EQ(ran.err, "nbdtree: error: --bounds: 'modal' is gone; write nbd\n");
}

TEST(GoneNames, MayBeValuesOfOptionsAndNamesOfFiles) {
    const test::TemporaryFolder folder;
    const test::Ran ran = test::run(folder / "", {"inspect", "trust"});
    EXPECT_EQ(ran.status, 1);
    EXPECT_EQ(ran.err.find("is gone"), std::string::npos) << ran.err;
}

TEST(GoneNames, AreNotListed) {
    const test::TemporaryFolder folder;
    const std::string help = test::run(folder / "", {"--help"}).out;
    EXPECT_NE(help.find("coverage"), std::string::npos);
    for (const char* old : {"trust", "carry", "bench"}) EXPECT_EQ(help.find(old), std::string::npos) << old;
}

}  // namespace
}  // namespace nbd
