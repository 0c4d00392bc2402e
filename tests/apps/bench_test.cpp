#include <nlohmann/json.hpp>

#include "tests/apps/small_files.hpp"

namespace nbd {
namespace {

using BenchSimulate = test::BoxFolder;

TEST_F(BenchSimulate, FindsBothSolversInAgreement) {
    const test::Ran ran =
        test::run(folder(), {"bench", "simulate", "box.h5", "--steps", "4", "-o", "table.csv", "--json"});
    ASSERT_EQ(ran.status, 0) << ran.err;
    const auto rows = nlohmann::json::parse(ran.out);
    ASSERT_EQ(rows.size(), 3U);
    for (const auto& row : rows) {
        EXPECT_EQ(row.at("body"), "box");
        EXPECT_GT(row.at("step_ratio").get<double>(), 0);
        EXPECT_LT(row.at("relative_difference").get<double>(), 1e-4) << row;
    }
    EXPECT_TRUE(test::listing(folder()).contains("table.csv"));
}

TEST_F(BenchSimulate, RefusesWhatItCannotTime) {
    const test::Ran none = test::run(folder(), {"bench", "simulate", "absent.h5"});
    EXPECT_EQ(none.status, 1);
    EXPECT_NE(none.err.find("absent.h5"), std::string::npos) << none.err;
    EXPECT_EQ(test::run(folder(), {"bench", "simulate", "box.h5", "--steps", "1"}).status, 2);
    EXPECT_EQ(test::run(folder(), {"bench"}).status, 2);
    EXPECT_EQ(test::run(folder(), {"bench", "simulate", "box.h5", "-o", "box.h5"}).status, 1);
}

}  // namespace
}  // namespace nbd
