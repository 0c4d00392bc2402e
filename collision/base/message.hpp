#pragma once

#include <sstream>
#include <string>

namespace nbd {

/// Joins the arguments, as a stream prints them, into the text of an error.
template <class... Parts>
std::string message(const Parts&... parts) {
    std::ostringstream out;
    (out << ... << parts);
    return out.str();
}

}  // namespace nbd
