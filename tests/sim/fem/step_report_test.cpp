#include "sim/fem/step_report.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <type_traits>

#include "collision/base/stopwatch.hpp"

namespace nbd {
namespace {

/// A report whose numbers are all 1, or true, or a trouble.
StepReport ones() {
    StepReport report;
    for (const StepNumber& number : step_numbers)
        std::visit(
            [&](auto member) {
                using Value = std::remove_reference_t<decltype(report.*member)>;
                report.*member = static_cast<Value>(1);
            },
            number.member);
    return report;
}

TEST(StepReport, AddsCountsAndTimesAlone) {
    StepReport sum = ones();
    sum.add(ones());
    std::set<std::string> names;
    int added = 0;
    for (const StepNumber& number : step_numbers) {
        EXPECT_TRUE(names.insert(number.name).second) << number.name;
        std::visit(
            [&](auto member) {
                EXPECT_EQ(static_cast<int>(sum.*member), number.adds ? 2 : 1) << number.name;
            },
            number.member);
        added += number.adds;
    }
    EXPECT_EQ(added, 12);
    EXPECT_EQ(sum.solve_us, 2);
    EXPECT_EQ(sum.elastic_energy, 1);
}

TEST(ScopedTimer, CountsEachMomentInTheInnermostTimer) {
    double whole = 0, inner = 0, innermost = 0;
    const Stopwatch watch;
    const int result = timed(whole, [&] {
        const ScopedTimer timer(inner);
        timed(innermost, [] {
            for (const Stopwatch inside; inside.microseconds() < 1000;) {
            }
        });
        return 3;
    });
    const double all = watch.microseconds();
    EXPECT_EQ(result, 3);
    EXPECT_GT(innermost, 0);
    EXPECT_GE(inner, 0);
    EXPECT_GE(whole, 0);
    EXPECT_LE(whole + inner + innermost, all);  // the innermost is most of it, and would count thrice
}

}  // namespace
}  // namespace nbd
