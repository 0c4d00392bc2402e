#include "collision/base/notice.hpp"

#include <atomic>

namespace nbd {
namespace {

std::atomic<NoticeHandler> installed{nullptr};
thread_local int silent = 0;  // scopes of NoNotices

}  // namespace

void set_notice_handler(NoticeHandler handler) noexcept { installed = handler; }

void notice(std::string_view line) noexcept {
    if (silent > 0) return;
    if (const NoticeHandler handler = installed) handler(line);
}

NoNotices::NoNotices() noexcept { ++silent; }
NoNotices::~NoNotices() { --silent; }

}  // namespace nbd
