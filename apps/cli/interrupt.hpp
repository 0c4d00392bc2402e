#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace nbd {

/// From now on, Ctrl-C and SIGTERM remove temporary files and end the program at once, with exit status 128
/// plus the signal's number and one line that says what is kept and how to go on. program: its name, for the
/// message. Call it once.
void catch_interrupts(std::string_view program);

/// What that line says from now on; empty: which files are written and that the same command starts anew, as
/// at first.
void say_on_interrupt(std::string kept);

/// From now on, the first such signal only makes interrupted() true, so that the command can stop when its
/// files are complete. A second signal ends the program at once. `finishes` false: as at first.
void finish_on_interrupt(bool finishes = true) noexcept;

/// Whether the line of the terminal in which the cursor is shall be erased before that message.
void clear_line_on_interrupt(bool clears) noexcept;

/// True once the user has asked to stop.
bool interrupted() noexcept;

/// Thrown by a command that the user stopped; the program's exit status is then 130. The text says what was
/// kept and how to continue.
struct Interrupted : std::runtime_error {
    using std::runtime_error::runtime_error;
};

}  // namespace nbd
