#pragma once

#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>

namespace nbd {

/// Joins the arguments, as a stream prints them, into the text of an error.
template <class... Parts>
std::string message(const Parts&... parts) {
    std::ostringstream out;
    (out << ... << parts);
    return out.str();
}

/// Throws std::invalid_argument, which names the subject and says what is wrong with it, unless a condition
/// holds.
class Requirement {
 public:
    /// subject: outlives the requirement.
    explicit constexpr Requirement(std::string_view subject) noexcept : subject_(subject) {}

    template <class... Parts>
    void operator()(bool ok, const Parts&... parts) const {
        if (!ok) throw std::invalid_argument(message(subject_, ": ", parts...));
    }

 private:
    std::string_view subject_;
};

}  // namespace nbd
