#pragma once

#include <functional>
#include <stdexcept>
#include <string>

namespace nbd::test {

/// Message of the Error that `action` throws; empty if it throws nothing. Any other exception fails the test.
template <class Error = std::exception>
std::string error_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

/// error_of for std::invalid_argument.
inline std::string refusal(const std::function<void()>& action) {
    return error_of<std::invalid_argument>(action);
}

}  // namespace nbd::test
