#pragma once

#include <string_view>

namespace nbd {

/// Receives a notice: something the caller should know although nothing failed, such as "tree.h5: ... is an
/// old name". `line` has no line break. May be called from any thread; must not throw.
using NoticeHandler = void (*)(std::string_view line);

/// Installs the process-wide handler; null, the default, drops notices. A program installs its handler once,
/// at the start.
void set_notice_handler(NoticeHandler handler) noexcept;

/// Passes a line to the handler.
void notice(std::string_view line) noexcept;

/// While alive, drops the notices of its thread, for work that repeats what has been told.
class NoNotices {
 public:
    NoNotices() noexcept;
    ~NoNotices();
    NoNotices(const NoNotices&) = delete;
    NoNotices& operator=(const NoNotices&) = delete;
};

}  // namespace nbd
