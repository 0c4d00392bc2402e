#pragma once

namespace nbd {

/// Allowed range of the constants of materials, of scales and of lengths, where they must be positive, so
/// that products of several of them are neither infinite nor zero.
constexpr double least_constant = 1e-30, max_constant = 1e30;

}  // namespace nbd
