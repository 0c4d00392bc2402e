#pragma once

#include <stdexcept>
#include <string_view>

#include "collision/base/message.hpp"

namespace nbd {

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
