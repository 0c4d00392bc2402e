#pragma once

#include <atomic>
#include <stdexcept>

namespace nbd {

/// From now on Ctrl-C and SIGTERM remove the temporary files and end the program at once, with exit status
/// 128 plus the signal's number.
void catch_interrupts();

/// From now on the first of these signals sets a flag alone, so that the command, which watches it, ends
/// where its files are whole.
void finish_on_interrupt() noexcept;

/// Becomes true when the user asks to stop.
const std::atomic<bool>& interrupt_flag() noexcept;

/// Whether the user has asked to stop.
inline bool interrupted() noexcept { return interrupt_flag().load(); }

/// Thrown by a command that stopped because of it; the program's exit status is then 130. The text says what
/// was kept and how to go on.
struct Interrupted : std::runtime_error {
    using std::runtime_error::runtime_error;
};

}  // namespace nbd
