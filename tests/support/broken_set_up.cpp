#include <gtest/gtest.h>

namespace {

/// A suite with a failing set-up, for the test of the guard: it must count as failed, not as skipped.
class BrokenSetUp : public ::testing::Test {
 protected:
    static void SetUpTestSuite() { ASSERT_EQ(1, 2); }
};

TEST_F(BrokenSetUp, IsAFailure) {}

}  // namespace
