#include "apps/figures/verdict.hpp"

#include <gtest/gtest.h>

namespace nbd {
namespace {

std::vector<EvaluationRow> rows(const std::vector<std::pair<double, double>>& missing_by_margin) {
    std::vector<EvaluationRow> result;
    for (const auto& [margin, missing] : missing_by_margin)
        for (int depth = 0; depth < 2; ++depth)
            result.push_back({.frames = "held-out trajectories",
                              .bound = BoundKind::nbd,
                              .depth = depth,
                              .margin = margin,
                              .radius_error = 0.01 + margin,
                              .nodes_missing = depth == 1 ? missing : missing / 2,
                              .nodes = 1000});
    return result;
}

TEST(Verdict, NamesTheMarginThatMissesAtMostOneNodeInAThousand) {
    const auto said = verdicts(rows({{0, 0.5}, {0.05, 0.002}, {0.1, 0.001}, {0.2, 0}}));
    ASSERT_EQ(said.size(), 1u);
    EXPECT_EQ(
        said[0],
        "On these poses (held-out trajectories) nbd bounds without a margin leave a part of 50 % of the "
        "nodes outside at the worst depth (1); with 10 % added to every radius they miss at most one node "
        "in a thousand on poses like these, with a mean radius error of 11.0 %.");
}

TEST(Verdict, ReportsThatNoMarginSuffices) {
    const auto said = verdicts(rows({{0, 0.5}, {0.25, 0.012}}));
    EXPECT_NE(said[0].find("and of one node in 83 even with 25 % added to every radius. Use exact bounds"),
              std::string::npos)
        << said[0];
}

TEST(Verdict, ReportsThatNothingWasMissed) {
    EXPECT_NE(verdicts(rows({{0, 0}, {0.25, 0}}))[0].find("contained every vertex in all 2000 spheres"),
              std::string::npos);
    EXPECT_NE(verdicts(rows({{0, 0.0004}}))[0].find(
                  "one node in 2500 outside at the worst depth (1): they miss at most"),
              std::string::npos);
}

TEST(Verdict, OfCalibratedBoundsNamesTheWorstDepth) {
    const std::vector<CoverageRow> coverage{{.bound = BoundKind::learned_affine,
                                             .depth = 0,
                                             .trajectories = 20,
                                             .miss_rate = 1e-3,
                                             .confidence = 0.9,
                                             .keeping = 20,
                                             .nodes_missing = 0,
                                             .inflation = 0.03,
                                             .out_of_range = 0.01},
                                            {.bound = BoundKind::learned_affine,
                                             .depth = 1,
                                             .trajectories = 20,
                                             .miss_rate = 1e-3,
                                             .confidence = 0.9,
                                             .keeping = 17,
                                             .nodes_missing = 0.0012,
                                             .inflation = 0.01,
                                             .out_of_range = 0.03}};
    const auto said = verdicts(coverage);
    ASSERT_EQ(said.size(), 1u);
    EXPECT_EQ(
        said[0],
        "With calibrated margins, learned_affine bounds missed 0.12 % of the nodes at the worst depth (1). "
        "The stated miss rate of 0.1 % is to hold in 90 % of the trajectories and held in 17 of 20. Radii "
        "are 2.0 % larger than the exact ones on average, and 2.0 % of the nodes were out of range and "
        "bounded exactly.");
    EXPECT_TRUE(verdicts(std::vector<CoverageRow>{}).empty());
}

}  // namespace
}  // namespace nbd
