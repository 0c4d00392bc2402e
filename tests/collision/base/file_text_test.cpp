#include "collision/base/file_text.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace nbd {
namespace {

/// The message of the error that reading a file ends with.
std::string error_of(const std::filesystem::path& path) {
    try {
        file_text(path);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return {};
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
    EXPECT_EQ(error_of("absent.json"), "absent.json: no such file");
    EXPECT_EQ(error_of("/proc/version/a"), "/proc/version/a: no such file");
    EXPECT_EQ(error_of("/proc"), "/proc: cannot be read: it is a folder");
    EXPECT_EQ(error_of("/dev/zero"),
              "/dev/zero: cannot be read: it is a special file; allowed: a regular file");
    // A regular file whose first page nobody may read.
    EXPECT_EQ(error_of("/proc/self/mem"), "/proc/self/mem: cannot be read: Input/output error");
}

}  // namespace
}  // namespace nbd
