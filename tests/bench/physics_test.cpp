#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "apps/bench/physics/physics_run.hpp"

namespace nbd {
namespace {

/// A check of two cases with these errors.
PhysicsResult result(double one, double other) {
    PhysicsResult made{.check = {"fall", "It is so.", "way, m", 0.01, {}, {}}, .rows = {}};
    made.rows = {{.at = {.size = 0.1}, .found = {.error = one}},
                 {.at = {.size = 10}, .found = {.error = other}}};
    return made;
}

TEST(Physics, TheWorstCaseDecides) {
    const PhysicsResult corner = result(1e-9, 0.5);
    EXPECT_FALSE(corner.held());
    EXPECT_EQ(corner.failed(), 1);
    EXPECT_EQ(corner.worst().at.size, 10);
    EXPECT_EQ(describe(corner.check, corner.worst().at), "size 10 m, dt 5 ms, 100000 Pa");
    EXPECT_TRUE(result(1e-9, 0.01).held());
    EXPECT_FALSE(result(std::numeric_limits<double>::infinity(), 0).held());
}

TEST(Physics, EveryCheckHasANameASectionAndQuickCases) {
    std::set<std::string> names;
    for (const PhysicsCheck& check : physics_checks()) {
        EXPECT_TRUE(names.insert(check.name).second) << check.name;
        EXPECT_THAT(check.section, testing::AllOf(testing::Ge(1), testing::Le(5))) << check.name;
        EXPECT_TRUE(std::ranges::any_of(check.cases, &PhysicsCase::quick)) << check.name;
    }
    EXPECT_EQ(names.size(), 66U);
}

}  // namespace
}  // namespace nbd
