#include <gtest/gtest.h>

namespace {

/// For a test of the guard: must end as failed, not as skipped.
class BrokenSetUp : public ::testing::Test {
 protected:
    static void SetUpTestSuite() { ASSERT_EQ(1, 2); }
};

TEST_F(BrokenSetUp, IsAFailure) {}

}  // namespace
