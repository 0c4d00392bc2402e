#pragma once

#include <cstddef>
#include <string>

namespace nbd {

/// Description of the machine for tables of times: CPU, instruction set, cores, caches and compiler. Leaves
/// out what the system does not report.
std::string this_machine();

/// Bytes that the program has allocated and not freed; 0 if the C library does not report them.
std::size_t heap_bytes();

/// Processor time of all threads of the program, in seconds, which other programs on the machine hardly
/// change.
double processor_seconds();

}  // namespace nbd
