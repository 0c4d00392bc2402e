#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

namespace {

/// GoogleTest and CTest report the tests of a suite with a failing set-up as skipped. This listener ends the
/// program as failed first.
class SetUpGuard : public ::testing::EmptyTestEventListener {
    void OnTestStart(const ::testing::TestInfo&) override {
        const ::testing::TestSuite& suite = *::testing::UnitTest::GetInstance()->current_test_suite();
        if (!suite.ad_hoc_test_result().Failed()) return;
        std::fprintf(stderr, "set-up of %s failed\n", suite.name());
        std::exit(EXIT_FAILURE);
    }
};

// GoogleTest owns the listener.
const bool listening = [] {
    ::testing::UnitTest::GetInstance()->listeners().Append(new SetUpGuard);
    return true;
}();

}  // namespace
