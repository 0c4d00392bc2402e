#include "collision/base/file_text.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

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

}  // namespace
}  // namespace nbd
