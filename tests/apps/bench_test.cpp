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

using BenchLocal = test::SmallFiles;

TEST_F(BenchLocal, ComparesEveryChoiceAtEveryDepth) {
    make({"dataset", "box.h5", "-o", "more.h5", "--trajectories", "10", "--frames", "12", "--steps-per-frame",
          "1", "-q"});
    const test::Ran ran =
        test::run(folder(), {"bench", "local", "box.h5", "more.h5", "--depth", "2", "--samples", "16,0",
                             "--max-frames", "40", "-o", "local.csv", "--json"});
    ASSERT_EQ(ran.status, 0) << ran.err;
    const auto rows = nlohmann::json::parse(ran.out);
    ASSERT_EQ(rows.size(), 84U);  // two rules, two numbers of samples, seven fits, three depths
    for (const auto& row : rows) {
        EXPECT_LT(row.at("radius_error").get<double>(), 0.5) << row;
        EXPECT_GT(row.at("inflation").get<double>(), -0.01) << row;
        EXPECT_LE(row.at("nodes_missing").get<double>(), row.at("nodes_missing_bare").get<double>()) << row;
        const bool timed = row.at("fit") != "network 32" && row.at("fit") != "network relative";
        EXPECT_EQ(row.at("nanoseconds").get<double>() > 0, timed) << row;
    }
    EXPECT_TRUE(test::listing(folder()).contains("local.csv"));
    const test::Ran few = test::run(folder(), {"bench", "local", "box.h5", "data.h5"});
    EXPECT_EQ(few.status, 1);
    EXPECT_NE(few.err.find("1 trajectories held out, at least 2 needed"), std::string::npos) << few.err;
}

}  // namespace
}  // namespace nbd
