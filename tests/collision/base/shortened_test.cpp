#include "collision/base/shortened.hpp"

#include <gtest/gtest.h>

namespace nbd {
namespace {

TEST(Shortened, KeepsShortTextsAndCutsOthersBetweenCharacters) {
    EXPECT_EQ(shortened("", 0), "");
    EXPECT_EQ(shortened("abcd", 4), "abcd");
    EXPECT_EQ(shortened("abcde", 4), "abcd...");
    EXPECT_EQ(shortened("ab\u20ac", 5), "ab\u20ac");
    for (const std::size_t longest : {2U, 3U, 4U}) EXPECT_EQ(shortened("ab\u20acd", longest), "ab...");
    EXPECT_EQ(shortened("ab\u20acd", 5), "ab\u20ac...");
    EXPECT_EQ(shortened("\x80\x80\x80", 2), "...");  // is no UTF-8
}

}  // namespace
}  // namespace nbd
