#pragma once

#include <atomic>
#include <stdexcept>

namespace nbd {

/// From now on Ctrl-C and SIGTERM set a flag alone, so that a command ends where its files are whole; a
/// second one removes the temporary files and ends the program at once.
void catch_interrupts();

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
