// Files that the system cannot read.
#include <gtest/gtest.h>

#include "meshing/h5/reader.hpp"
#include "meshing/h5/writer.hpp"
#include "tests/support/failing_reads.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd::h5 {
namespace {

using ReadErrors = test::FileTest;

const Format readable{"nbdtree test", 1};

TEST_F(ReadErrors, AreNeverTakenForAnAnswer) {
    const auto path = folder / "a.h5";
    Writer writer(path, readable);
    writer.write("group/numbers", std::vector<int>{1, 2, 3});
    writer.attribute("group", "name", "value");
    writer.write_text("text", "a text");
    writer.link("link", "/text");
    writer.commit();
    const int failed = test::with_each_read_failing(path, [&] {
        const Reader file(path, readable);
        EXPECT_TRUE(file.has("group/numbers"));
        EXPECT_FALSE(file.has("group/others"));
        EXPECT_TRUE(file.has_attribute("group", "name"));
        EXPECT_FALSE(file.has_attribute("group", "other"));
        EXPECT_EQ(file.link_target("link"), "/text");
        EXPECT_EQ(file.read_text("link"), "a text");
        EXPECT_EQ(file.read<int>("group/numbers", {any}).size(), 3u);
    });
    EXPECT_GT(failed, 4);
}

}  // namespace
}  // namespace nbd::h5
