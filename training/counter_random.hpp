#pragma once

#include <cstdint>

namespace nbd {

/// Random bits that depend on the arguments alone, so that any thread may draw any number at any time and
/// get the same one everywhere. Two rounds of the finaliser of SplitMix64 over the mixed arguments.
/// seed: of the whole run. stream: who draws (a node, a trajectory). counter: which draw.
constexpr std::uint64_t counter_random(std::uint64_t seed, std::uint64_t stream,
                                       std::uint64_t counter) noexcept {
    const auto mix = [](std::uint64_t v) {
        v = (v ^ (v >> 30)) * 0xbf58476d1ce4e5b9ull;
        v = (v ^ (v >> 27)) * 0x94d049bb133111ebull;
        return v ^ (v >> 31);
    };
    const std::uint64_t key = mix(seed + 0x9e3779b97f4a7c15ull) ^ mix(stream + 0xd1b54a32d192ed03ull);
    return mix(mix(key + 0x9e3779b97f4a7c15ull * (counter + 1)) + stream);
}

/// Uniform in [0, 1), 53 bits of it.
constexpr double counter_uniform(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) noexcept {
    return static_cast<double>(counter_random(seed, stream, counter) >> 11) * 0x1p-53;
}

/// Uniform in [0, n), n >= 1; the bias is below n / 2^53.
constexpr int counter_index(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter, int n) noexcept {
    return static_cast<int>(counter_uniform(seed, stream, counter) * n);
}

}  // namespace nbd
