#pragma once

#include <span>
#include <string>

namespace nbd {

/// Bytes as text in base 64 (RFC 4648), padded.
std::string base64(std::span<const unsigned char> bytes);

}  // namespace nbd
