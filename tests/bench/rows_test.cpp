#include "apps/bench/measure/rows.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

TEST(Rows, AreWrittenAsCsvAndAsText) {
    const Rows rows{
        {{"name", "a, \"b\""}, {"count", 12345}, {"share", 0.123456}, {"holds", true}, {"note", nullptr}},
        {{"name", "c"}, {"count", 1}, {"share", INFINITY}, {"holds", false}, {"note", "x"}}};
    const test::TemporaryFolder folder;
    write_csv(folder / "rows.csv", rows);
    std::stringstream text;
    text << std::ifstream(folder / "rows.csv").rdbuf();
    const std::string csv = text.str();
    EXPECT_TRUE(csv.starts_with("# "));
    EXPECT_EQ(csv.substr(csv.find('\n') + 1),
              "name,count,share,holds,note\n\"a, \"\"b\"\"\",12345,0.123456,1,\nc,1,inf,0,x\n");
    EXPECT_EQ(sum_of(rows, "count"), 12346);
    EXPECT_EQ(to_text(rows, {"name", "count", "share"}),
              "name    count  share\na, \"b\"  12345  0.123\nc           1    inf");
}

}  // namespace
}  // namespace nbd
