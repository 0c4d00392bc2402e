#include "tests/support/failing_reads.hpp"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>

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

int with_each_read_failing(const std::filesystem::path& path, const std::function<void()>& read) {
    struct Healing {
        ~Healing() { reads_left = -1; }
    } healing;
    for (int failed = 0;; ++failed) {
        reads_left = failed;
        try {
            read();
            EXPECT_GE(reads_left, 0) << "read " << failed << " failed, and nobody was told";
            return failed;
        } catch (const h5::ReadError& error) {
            EXPECT_EQ(error.what(), path.string() + ": cannot be read: Input/output error");
        }
    }
}

}  // namespace nbd::test
