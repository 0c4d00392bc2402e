#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace nbd {

/// The bytes of a text in base 64 (RFC 4648); white space is skipped. Padding may stand between groups, as
/// where several encoded blocks follow each other. Empty if it is none.
std::optional<std::string> from_base64(std::string_view text);

/// Bytes as text in base 64, padded.
std::string to_base64(std::string_view bytes);

}  // namespace nbd
