#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <numbers>

// Counter-based random numbers for the simulator and for training; the collision library draws none. Each is
// a pure function of (seed, stream, counter), so its bits do not depend on the platform, the threads or the
// draws of other streams. Files depend on these bits (recipes of recordings, held-out frames of a tree), so
// no formula here may change.
namespace nbd {

/// Finaliser of SplitMix64: a bijection in which every input bit affects every output bit.
constexpr std::uint64_t mix_bits(std::uint64_t z) noexcept {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/// The golden ratio in 64 bits, the step of SplitMix64.
inline constexpr std::uint64_t golden_step = 0x9e3779b97f4a7c15u;

/// Maps 64 random bits to a number in [0, 1), using the top 53.
constexpr double unit_interval(std::uint64_t bits) noexcept {
    return static_cast<double>(bits >> 11) * 0x1p-53;
}

/// Random access to any draw. seed: the seed of the run. stream: the drawer's number (a node, a trajectory).
/// counter: the draw's number in the stream.
constexpr std::uint64_t counter_random(std::uint64_t seed, std::uint64_t stream,
                                       std::uint64_t counter) noexcept {
    const std::uint64_t key = mix_bits(seed + golden_step) ^ mix_bits(stream + 0xd1b54a32d192ed03u);
    return mix_bits(mix_bits(key + golden_step * (counter + 1)) + stream);
}

/// Uniform in [0, 1).
constexpr double counter_uniform(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) noexcept {
    return unit_interval(counter_random(seed, stream, counter));
}

/// Uniform in 0 .. n - 1. n: >= 1. The bias is below n / 2^53.
constexpr int counter_index(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter, int n) noexcept {
    return static_cast<int>(counter_uniform(seed, stream, counter) * n);
}

/// Successive draws of one stream, when their number is not known beforehand. They differ from the draws of
/// counter_random() for the same seed and stream.
class CounterRandom {
 public:
    CounterRandom(std::uint64_t seed, std::uint64_t stream) noexcept
        : key_(mix_bits(mix_bits(seed) ^ (stream + golden_step))) {}

    std::uint64_t bits() noexcept { return mix_bits(key_ + ++counter_ * golden_step); }

    /// In [0, 1).
    double unit() noexcept { return unit_interval(bits()); }
    double uniform(double low, double high) noexcept { return low + (high - low) * unit(); }

    /// In 0 .. count - 1. count: > 0. The bias is below count / 2^53.
    int index(int count) noexcept { return static_cast<int>(unit() * count); }

    /// Uniform on the unit sphere.
    Eigen::Vector3d direction() noexcept {
        const double z = uniform(-1, 1), angle = uniform(0, 2 * std::numbers::pi);
        const double r = std::sqrt(std::fmax(0.0, 1 - z * z));
        return {r * std::cos(angle), r * std::sin(angle), z};
    }

    /// Uniform over all orientations, from three numbers: the subgroup method turns a random frame about its
    /// own axis.
    Eigen::Quaterniond orientation() noexcept {
        const double u = unit(), a = uniform(0, 2 * std::numbers::pi), b = uniform(0, 2 * std::numbers::pi);
        const double s = std::sqrt(1 - u), t = std::sqrt(u);
        return {t * std::cos(b), s * std::sin(a), s * std::cos(a), t * std::sin(b)};
    }

 private:
    std::uint64_t key_, counter_ = 0;
};

}  // namespace nbd
