#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "collision/base/counter_random.hpp"
#include "collision/base/file_text.hpp"
#include "collision/base/shortened.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

TEST(CounterRandom, KeepsTheBitsOnWhichFilesDepend) {
    CounterRandom random(1, 2);
    EXPECT_EQ(random.bits(), 0xc2c354894ca58872u);
    EXPECT_EQ(random.bits(), 0xd08b293d0d3a28d9u);
    EXPECT_EQ(counter_random(1, 2, 0), 0x12dc053355a94bdu);
    EXPECT_EQ(counter_random(1, 2, 1), 0x1b637ea80b3012bbu);
}

TEST(CounterRandom, GivesEqualBitsForEqualCountersAndDifferentBitsOtherwise) {
    CounterRandom a(1, 2), b(1, 2), other_stream(1, 3), other_seed(2, 2);
    for (int i = 0; i < 100; ++i) {
        const auto bits = a.bits();
        EXPECT_EQ(bits, b.bits());
        EXPECT_NE(bits, other_stream.bits());
        EXPECT_NE(bits, other_seed.bits());
    }
}

TEST(CounterRandom, FillsItsRangesEvenly) {
    CounterRandom random(3, 0);
    double sum = 0;
    Eigen::Vector3d directions = Eigen::Vector3d::Zero();
    std::vector<int> hits(5);
    for (int i = 0; i < 20000; ++i) {
        const double u = random.uniform(2, 4);
        ASSERT_TRUE(u >= 2 && u < 4);
        sum += u;
        directions += random.direction();
        ++hits.at(random.index(5));
        ASSERT_NEAR(random.orientation().norm(), 1, 1e-12);
    }
    EXPECT_NEAR(sum / 20000, 3, 0.02);
    EXPECT_LT(directions.norm() / 20000, 0.02);
    for (const int count : hits) EXPECT_NEAR(count, 4000, 300);
}

std::string refusal_of(const std::filesystem::path& path) {
    return test::error_of<std::runtime_error>([&] { file_text(path); });
}

TEST(FileText, HasEveryByte) {
    const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "file_text_test.bin";
    std::string bytes(200'000, '\0');
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * i >> 3);
    std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    EXPECT_EQ(file_text(path), bytes);
    std::ofstream(path, std::ios::binary).flush();
    EXPECT_EQ(file_text(path), "");
    std::filesystem::remove(path);
}

TEST(FileText, SaysInOneLineWhyAFileCannotBeRead) {
    EXPECT_EQ(refusal_of("absent.json"), "absent.json: no such file");
    EXPECT_EQ(refusal_of("/proc/version/a"), "/proc/version/a: no such file");
    EXPECT_EQ(refusal_of("/proc"), "/proc: cannot be read: it is a folder");
    EXPECT_EQ(refusal_of("/dev/zero"),
              "/dev/zero: cannot be read: it is a special file; allowed: a regular file");
    // A regular file whose first page nobody may read.
    EXPECT_EQ(refusal_of("/proc/self/mem"), "/proc/self/mem: cannot be read: Input/output error");
}

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
