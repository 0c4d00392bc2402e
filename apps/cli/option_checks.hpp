#pragma once

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "collision/tree/collision_tree.hpp"

namespace nbd {

/// Accepts finite numbers that `allows` accepts; for whole numbers use whole_number(). allowed: description
/// for the message and --help, as in "> 0".
template <class Allows>
CLI::Validator number_check(std::string allowed, Allows allows) {
    return CLI::Validator(
        [allowed, allows](std::string& text) {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && std::isfinite(value) && allows(value))
                return std::string();
            return fmt::format("is '{}'; allowed: a number {}", text, allowed);
        },
        allowed);
}

/// Finite and > 0.
inline CLI::Validator positive() {
    return number_check("> 0", [](double value) { return value > 0; });
}

/// Finite and >= 0.
inline CLI::Validator not_negative() {
    return number_check(">= 0", [](double value) { return value >= 0; });
}

/// Whole number, low <= number <= high.
CLI::Validator whole_number(std::int64_t low, std::int64_t high);

/// Whole number >= 0 that an int holds.
CLI::Validator not_negative_whole();

/// Unsigned 64-bit whole number. CLI11 alone would let larger numbers wrap around.
CLI::Validator seed_check();

/// A port of this machine; 0 or nothing: any. The option takes the word behind it, so the message says what
/// to do if that was meant for another argument.
CLI::Validator port_number();

/// low <= number <= high.
inline CLI::Validator between(double low, double high) {
    return number_check(fmt::format(">= {} and <= {}", low, high),
                        [low, high](double value) { return value >= low && value <= high; });
}

/// One of these names; the message of another one names the nearest, if one is near.
CLI::Validator one_of(std::vector<std::string> names);

/// Names of these bounds.
CLI::Validator bounds_name(std::span<const BoundKind> kinds = bound_kinds);

}  // namespace nbd
