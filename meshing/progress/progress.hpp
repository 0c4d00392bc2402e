#pragma once

#include <functional>
#include <string_view>

namespace nbd {

/// Receives how far a piece of long work is: `done` of `total` steps of `what`; total 0: not known.
using ProgressHandler = std::function<void(std::string_view what, double done, double total)>;

/// Sets who is told; an empty function: nobody, as at the start of a program. Call it before long work
/// begins.
void set_progress_handler(ProgressHandler handler);

/// Tells how far a piece of long work is, from any thread. Calls that come while another one is being told
/// are dropped, so that threads do not wait for each other, but for the last one, where done is total.
void tell_progress(std::string_view what, double done, double total);

}  // namespace nbd
