#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

namespace {

/// Where the set-up of a suite fails, GoogleTest calls its tests skipped, and so does CTest. This ends the
/// program as failed instead, before it says so.
class SetUpGuard : public ::testing::EmptyTestEventListener {
    void OnTestStart(const ::testing::TestInfo&) override {
        const ::testing::TestSuite& suite = *::testing::UnitTest::GetInstance()->current_test_suite();
        if (!suite.ad_hoc_test_result().Failed()) return;
        std::fprintf(stderr, "set-up of %s failed\n", suite.name());
        std::exit(EXIT_FAILURE);
    }
};

// GoogleTest owns its listeners.
const bool listening = [] {
    ::testing::UnitTest::GetInstance()->listeners().Append(new SetUpGuard);
    return true;
}();

}  // namespace
