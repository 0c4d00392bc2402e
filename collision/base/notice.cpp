#include "collision/base/notice.hpp"

#include <atomic>

namespace nbd {
namespace {

std::atomic<NoticeHandler> installed{nullptr};

}  // namespace

void set_notice_handler(NoticeHandler handler) noexcept { installed = handler; }

void notice(std::string_view line) noexcept {
    if (const NoticeHandler handler = installed) handler(line);
}

}  // namespace nbd
