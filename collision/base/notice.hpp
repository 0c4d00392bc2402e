#pragma once

#include <string_view>

namespace nbd {

/// Receives what a caller should know although nothing failed: "tree.h5: ... is an old name". One line without a
/// line break. May be called from any thread; must not throw.
using NoticeHandler = void (*)(std::string_view line);

/// Installs the process's handler; null, the default, drops notices. Programs install theirs once, at the start.
void set_notice_handler(NoticeHandler handler) noexcept;

/// Hands a line to the handler.
void notice(std::string_view line) noexcept;

}  // namespace nbd
