#include "sim/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace nbd {

void write_file_atomically(const std::filesystem::path& path, std::string_view content) {
    const std::string temporary = fmt::format("{}.{}.tmp", path.string(), ::getpid());
    const auto fail = [&](const char* doing) {
        const int reason = errno;
        ::unlink(temporary.c_str());
        throw std::runtime_error(
            fmt::format("{}: cannot {}: {}", path.string(), doing, std::strerror(reason)));
    };
    const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (file < 0) fail("create the file");
    while (!content.empty()) {
        const ::ssize_t written = ::write(file, content.data(), content.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) {
            const int reason = errno;
            ::close(file);
            errno = reason;
            fail("write");
        }
        content.remove_prefix(static_cast<std::size_t>(written));
    }
    const int flushed = ::fsync(file);
    const int reason = errno;
    const int closed = ::close(file);
    if (flushed != 0) errno = reason;
    if (flushed != 0 || closed != 0) fail("flush to disk");
    if (::rename(temporary.c_str(), path.c_str()) != 0) fail("rename the finished file");
}

}  // namespace nbd
