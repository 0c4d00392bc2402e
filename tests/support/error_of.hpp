#pragma once

#include <functional>
#include <stdexcept>
#include <string>

namespace nbd::test {

/// The text of the Error that `action` throws; "" where it throws none. Anything else that it throws fails
/// the test.
template <class Error = std::exception>
std::string error_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

/// error_of for what must be std::invalid_argument.
inline std::string refusal(const std::function<void()>& action) {
    return error_of<std::invalid_argument>(action);
}

}  // namespace nbd::test
