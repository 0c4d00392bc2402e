#pragma once

#include <functional>
#include <stdexcept>
#include <string>

namespace nbd {

/// The text of the std::invalid_argument that `action` throws, or "no error".
inline std::string error_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const std::invalid_argument& e) {
        return e.what();
    }
    return "no error";
}

}  // namespace nbd
