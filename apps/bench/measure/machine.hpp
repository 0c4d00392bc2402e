#pragma once

#include <string>

namespace nbd {

/// The processor's name, its cores and caches, and the compiler: what a table of times must say. Parts that
/// the system does not tell are left out.
std::string this_machine();

}  // namespace nbd
