#include "apps/dataset/claims.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <thread>

namespace nbd {

Claims::Claims(const std::filesystem::path& file)
    : file_(file), descriptor_(open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
    if (descriptor_ < 0)
        throw std::runtime_error(fmt::format("{}: cannot open: {}", file.string(), std::strerror(errno)));
}

Claims::~Claims() { close(descriptor_); }

void Claims::Release::operator()(const Claims* claims) const { claims->lock(item, F_UNLCK); }

bool Claims::lock(long item, short kind) const {
    struct flock range = {};
    range.l_type = kind;
    range.l_whence = SEEK_SET;
    range.l_start = item;
    range.l_len = 1;
    return fcntl(descriptor_, F_OFD_SETLK, &range) == 0;
}

Claims::Held Claims::try_claim(long item) const {
    if (lock(item, F_WRLCK)) return Held(this, Release{item});
    if (errno == EAGAIN || errno == EACCES) return Held(nullptr, Release{item});
    if (errno == ENOLCK || errno == EOPNOTSUPP || errno == ENOSYS || errno == EINVAL)
        return Held(this, Release{item});
    throw std::runtime_error(fmt::format("{}: cannot lock: {}", file_.string(), std::strerror(errno)));
}

Claims::Held Claims::wait_for(long item, const std::function<void()>& idle) const {
    for (;;) {
        if (Held held = try_claim(item)) return held;
        idle();
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
}

}  // namespace nbd
