#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace nbd {

/// Numbers drawn from a counter: draw i of stream (seed, stream) is a pure function of the three, so the
/// bits depend neither on the platform nor on what other streams drew.
class CounterRandom {
 public:
    CounterRandom(std::uint64_t seed, std::uint64_t stream) noexcept
        : key_(mix(mix(seed) ^ (stream + 0x9e3779b97f4a7c15u))) {}

    std::uint64_t bits() noexcept { return mix(key_ + ++counter_ * 0x9e3779b97f4a7c15u); }

    /// In [0, 1), 53 bits.
    double unit() noexcept { return static_cast<double>(bits() >> 11) * 0x1p-53; }
    double uniform(double low, double high) noexcept { return low + (high - low) * unit(); }

    /// In 0 .. count - 1. count: > 0. The bias, below count / 2^53, does not matter here.
    int index(int count) noexcept { return static_cast<int>(unit() * count); }

    /// Uniform on the unit sphere.
    Eigen::Vector3d direction() noexcept {
        const double z = uniform(-1, 1), angle = uniform(0, 2 * std::numbers::pi);
        const double r = std::sqrt(std::fmax(0.0, 1 - z * z));
        return {r * std::cos(angle), r * std::sin(angle), z};
    }

    /// Uniform over all orientations: a random axis frame turned about its own axis, by the subgroup
    /// method, from three numbers.
    Eigen::Quaterniond orientation() noexcept {
        const double u = unit(), a = uniform(0, 2 * std::numbers::pi), b = uniform(0, 2 * std::numbers::pi);
        const double s = std::sqrt(1 - u), t = std::sqrt(u);
        return {t * std::cos(b), s * std::sin(a), s * std::cos(a), t * std::sin(b)};
    }

 private:
    /// Finaliser of SplitMix64: a bijection that passes through every bit.
    static std::uint64_t mix(std::uint64_t z) noexcept {
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }

    std::uint64_t key_, counter_ = 0;
};

}  // namespace nbd
