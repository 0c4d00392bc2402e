#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>

#include "apps/bench/physics/physics_run.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// A check of two cases with these errors.
PhysicsResult result(const std::string& name, double one, double other, double allowed = 0.01) {
    PhysicsCheck check;
    check.name = name;
    check.truth = "It is so.";
    check.allowed = allowed;
    PhysicsResult made{.check = check, .rows = {}};
    made.rows = {{.at = {.size = 0.1}, .found = {.error = one}},
                 {.at = {.size = 10, .intersection_free = true}, .found = {.error = other}}};
    return made;
}

TEST(Physics, TheWorstCaseDecides) {
    const PhysicsResult corner = result("fall", 1e-9, 0.5);
    EXPECT_FALSE(corner.held());
    EXPECT_EQ(corner.failed(), 1);
    EXPECT_EQ(corner.worst().at.size, 10);
    EXPECT_TRUE(result("fall", 1e-9, 0.01).held());
    EXPECT_FALSE(result("fall", infinity, 0).held());
}

TEST(Physics, ChangesOfTheListAreTold) {
    const std::vector<PhysicsResult> results{result("fall", 0.02, 0), result("slide", 0, 0),
                                             result("roll", 0.2, 0.3)};
    EXPECT_THAT(changes(results, std::vector<KnownFault>{{"fall", 1, 0.02}, {"roll", 2, 0.3}}), IsEmpty());
    EXPECT_THAT(changes(results, std::vector<KnownFault>{{"fall", 1, 0.019}, {"roll", 2, infinity}}),
                IsEmpty());
    EXPECT_THAT(changes(results, std::vector<KnownFault>{{"fall", 1, 0.017}, {"roll", 2, 0.3}}),
                ElementsAre(HasSubstr("fall: error 0.02 at size 0.1 m")))
        << "became worse";
    EXPECT_THAT(
        changes(results, std::vector<KnownFault>{{"fall", 1, 0.02}}),
        ElementsAre(HasSubstr("roll: error 0.3 at size 10 m, dt 5 ms, 100000 Pa, free; allowed: 0.01")))
        << "not listed";
    EXPECT_THAT(
        changes(results, std::vector<KnownFault>{{"fall", 1, 0.02}, {"roll", 2, 0.3}, {"slide", 1, 1}}),
        ElementsAre(HasSubstr("slide holds now")));
    EXPECT_THAT(changes(results, std::vector<KnownFault>{{"fall", 1, 0.02}, {"roll", 1, 0.3}}),
                ElementsAre("roll: 2 cases fail; listed: 1"));
    EXPECT_THAT(changes(std::vector{result("fall", 0, infinity)}, std::vector<KnownFault>{{"fall", 1, 100}}),
                ElementsAre(HasSubstr("fall: error inf")));
}

TEST(Physics, TheListIsReadAsItWasWritten) {
    const test::TemporaryFolder folder;
    write_known_faults(folder / "known.csv", std::vector{result("fall", 0.0201, 0), result("slide", 0, 0),
                                                         result("roll", infinity, 0)});
    const std::vector<KnownFault> known = read_known_faults(folder / "known.csv");
    ASSERT_EQ(known.size(), 2U);
    EXPECT_EQ(known[0].check, "fall");
    EXPECT_EQ(known[0].failed, 1);
    EXPECT_EQ(known[0].error, 0.0201);
    EXPECT_EQ(known[1].check, "roll");
    EXPECT_EQ(known[1].error, infinity);
    for (const char* bad :
         {"fall", "fall,", "fall,1", "fall,1,", "fall,1,much", "fall,1,1 2", "fall,1,1,1"}) {
        std::ofstream(folder / "bad.csv") << "check,failed,error\n" << bad << '\n';
        EXPECT_THAT(test::error_of([&] { read_known_faults(folder / "bad.csv"); }),
                    HasSubstr("bad.csv: line 2 is '"))
            << bad;
    }
    EXPECT_THAT(test::error_of([&] { read_known_faults(folder / "none.csv"); }),
                HasSubstr("none.csv: cannot be read"));
}

}  // namespace
}  // namespace nbd
