#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace nbd {

/// CRC-64/XZ: the polynomial of ECMA-182, bits reflected, start and result inverted. The CRC of "123456789"
/// is 0x995dc9bbdf1939fa. crc64(b, crc64(a)) is the CRC of a followed by b. Any change within 64 neighbouring
/// bits changes the CRC.
inline std::uint64_t crc64(std::span<const std::byte> bytes, std::uint64_t before = 0) noexcept {
    static constexpr auto table = [] {
        std::array<std::uint64_t, 256> remainders{};
        for (std::size_t i = 0; i < remainders.size(); ++i) {
            std::uint64_t crc = i;
            for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ (crc & 1 ? 0xc96c5795d7870f42u : 0u);
            remainders[i] = crc;
        }
        return remainders;
    }();
    std::uint64_t crc = ~before;
    for (const std::byte b : bytes)
        crc = table[(crc ^ std::to_integer<std::uint64_t>(b)) & 0xff] ^ (crc >> 8);
    return ~crc;
}

}  // namespace nbd
