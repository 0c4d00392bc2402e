// Files that the system cannot read. `pread` of this program fails when it is told to.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>

#include "meshing/h5/reader.hpp"
#include "meshing/h5/writer.hpp"
#include "tests/support/file_damage.hpp"

namespace {

std::atomic<int> reads_left = -1;  // until one fails; below zero: none does

}  // namespace

extern "C" ssize_t pread(int file, void* bytes, size_t count, off_t offset) {
    static const auto real = reinterpret_cast<decltype(&pread)>(dlsym(RTLD_NEXT, "pread"));
    if (reads_left >= 0 && reads_left-- == 0) {
        errno = EIO;
        return -1;
    }
    return real(file, bytes, count, offset);
}

namespace nbd::h5 {
namespace {

using ReadErrors = test::FileTest;

const Format readable{"nbdtree test", 1};

void read_all(const std::filesystem::path& path) {
    const Reader file(path, readable);
    EXPECT_TRUE(file.has("group/numbers"));
    EXPECT_FALSE(file.has("group/others"));
    EXPECT_TRUE(file.has_attribute("group", "name"));
    EXPECT_FALSE(file.has_attribute("group", "other"));
    EXPECT_EQ(file.link_target("link"), "/text");
    EXPECT_EQ(file.read_text("link"), "a text");
    EXPECT_EQ(file.read<int>("group/numbers", {any}).size(), 3u);
}

TEST_F(ReadErrors, AreNeverTakenForAnAnswer) {
    const auto path = folder / "a.h5";
    Writer file(path, readable);
    file.write("group/numbers", std::vector<int>{1, 2, 3});
    file.attribute("group", "name", "value");
    file.write_text("text", "a text");
    file.link("link", "/text");
    file.commit();
    int failed = 0;
    for (bool is_whole = false; !is_whole; ++failed) {
        reads_left = failed;
        try {
            read_all(path);
            is_whole = reads_left >= 0;
            EXPECT_TRUE(is_whole) << "read " << failed << " failed, and nobody was told";
        } catch (const ReadError& error) {
            EXPECT_EQ(error.what(), path.string() + ": cannot be read: Input/output error");
        }
        ASSERT_EQ(::testing::Test::HasFailure(), false);
    }
    reads_left = -1;
    EXPECT_GT(failed, 5);
}

}  // namespace
}  // namespace nbd::h5
