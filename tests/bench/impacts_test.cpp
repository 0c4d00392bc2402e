#include <gtest/gtest.h>

#include <filesystem>

#include "apps/bench/exactness/impact_checks.hpp"

namespace nbd {
namespace {

TEST(ImpactQueries, AgreeWithExactAnswers) {
    const auto folder = std::filesystem::path(NBD_SHARED_MESHES).parent_path() / "ccd";
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "needs the queries in " << folder;
    ImpactScore all;
    for (const ImpactQueries& queries : read_impact_queries(folder)) {
        const ImpactScore s = score(queries);
        EXPECT_EQ(s.missed, 0) << s.scene;
        all.queries += s.queries;
        all.collisions += s.collisions;
        all.false_alarms += s.false_alarms;
        all.exhausted += s.exhausted;
    }
    EXPECT_GT(all.queries, 5000);
    EXPECT_GT(all.collisions, 200);
    EXPECT_LE(all.exhausted, 2);
    // These have an answer only beyond the rounding of their coordinates to double.
    EXPECT_LT(all.false_alarms, all.queries / 100);
}

}  // namespace
}  // namespace nbd
