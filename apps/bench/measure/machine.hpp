#pragma once

#include <string>

namespace nbd {

/// Description of the machine for tables of times: CPU, instruction set, cores, caches and compiler. Leaves
/// out what the system does not report.
std::string this_machine();

}  // namespace nbd
