#pragma once

#include <map>
#include <string>

namespace nbd {

/// What `nbdtree` prints if no command is named.
std::string first_steps();

/// Examples for the --help of each command: two or more, a line each.
std::map<std::string, std::string> command_examples();

}  // namespace nbd
