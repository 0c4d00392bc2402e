#include "tests/support/failing_reads.hpp"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <string>

#include "meshing/h5/types.hpp"

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

namespace nbd::test {

int with_each_read_failing(const std::function<void()>& read) {
    int failed = 0;
    for (bool is_whole = false; !is_whole && !::testing::Test::HasFailure(); ++failed) {
        reads_left = failed;
        try {
            read();
            is_whole = reads_left >= 0;
            EXPECT_TRUE(is_whole) << "read " << failed << " failed, and nobody was told";
        } catch (const h5::ReadError& error) {
            EXPECT_TRUE(std::string(error.what()).ends_with(": cannot be read: Input/output error"))
                << error.what();
        }
    }
    reads_left = -1;
    return failed - 1;
}

}  // namespace nbd::test
