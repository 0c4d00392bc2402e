#pragma once

#include <string_view>

namespace nbd {

/// Release number, such as "0.2.0".
std::string_view version() noexcept;

/// Release number and `git describe --always --dirty --tags` of the sources: "0.2.0 (v0.1.0-12-g0123abc)".
/// The release alone if built outside a repository.
std::string_view build_version() noexcept;

}  // namespace nbd
