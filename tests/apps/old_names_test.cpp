#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/apps/command.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

/// The names of release 0.1 work until release 0.3, each with one line that says today's name.
TEST(OldNames, OfCommandsAndOptionsWorkWithAWarning) {
    const test::TemporaryFolder folder;
    const auto run = [&](const std::vector<std::string>& arguments, const std::string& warning) {
        const test::Ran ran = test::run(folder / "", arguments);
        EXPECT_EQ(ran.status, 0) << ran.err;
        EXPECT_EQ(ran.err, "nbdtree: warning: " + warning + "; release 0.3 will not accept the old name\n");
        return ran.out;
    };
    EXPECT_NE(run({"trust", "--help"}, "`nbdtree trust` is now called `nbdtree coverage`").find("--contacts"),
              std::string::npos);
    EXPECT_NE(run({"-q", "carry", "--help"}, "`nbdtree carry` is now called `nbdtree remap`").find("--from"),
              std::string::npos);
    run({"train", "--local-samples", "16", "--help"},
        "`nbdtree --local-samples` is now called `nbdtree --samples`");
}

TEST(OldNames, TheBenchCommandRunsTheBenchProgram) {
    const test::TemporaryFolder folder;
    const test::Ran ran = test::run(folder / "", {"bench", "peers", "--help"});
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_NE(ran.err.find("`nbdtree-bench`"), std::string::npos) << ran.err;
    EXPECT_NE(ran.out.find("--rounds"), std::string::npos) << ran.out;
}

TEST(OldNames, AreNotListed) {
    const test::TemporaryFolder folder;
    const std::string help = test::run(folder / "", {"--help"}).out;
    EXPECT_NE(help.find("coverage"), std::string::npos);
    for (const char* old : {"trust", "carry", "bench"}) EXPECT_EQ(help.find(old), std::string::npos) << old;
}

}  // namespace
}  // namespace nbd
