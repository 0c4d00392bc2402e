#pragma once

#include <ctime>

namespace nbd {

/// Processor time of all threads of the program, in seconds, which other programs on the machine hardly
/// change.
inline double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace nbd
