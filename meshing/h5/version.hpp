#pragma once

#include <string_view>

namespace nbd {

/// The release: "0.2.0".
std::string_view version() noexcept;

/// The release and what `git describe --always --dirty --tags` says of the sources: "0.2.0
/// (v0.1.0-12-g0123abc)". The release alone where the build has no repository.
std::string_view build_version() noexcept;

}  // namespace nbd
