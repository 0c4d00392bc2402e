#include "apps/cli/option_checks.hpp"

#include <limits>

#include "meshing/formats/words.hpp"
#include "sim/json/nearest_name.hpp"

namespace nbd {

namespace {

/// described: what --help says of the numbers.
CLI::Validator whole_number_check(std::int64_t low, std::int64_t high, const std::string& allowed,
                                  const std::string& described) {
    return CLI::Validator(
        [low, high, allowed](std::string& text) {
            std::int64_t value = 0;
            if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) return std::string();
            return fmt::format("is '{}'; allowed: a whole number {}", text, allowed);
        },
        described);
}

}  // namespace

CLI::Validator whole_number(std::int64_t low, std::int64_t high) {
    return whole_number_check(low, high, fmt::format("from {} to {}", low, high),
                              fmt::format("{} to {}", low, high));
}

CLI::Validator not_negative_whole() {
    return whole_number_check(0, std::numeric_limits<int>::max(), ">= 0", ">= 0");
}

CLI::Validator seed_check() {
    return CLI::Validator(
        [](std::string& text) {
            if (plain_number_in<std::uint64_t>(text)) return std::string();
            return fmt::format("is '{}'; allowed: a whole number from 0 to 2^64 - 1", text);
        },
        ">= 0");
}

CLI::Validator port_number() {
    return CLI::Validator(
        [](std::string& text) {
            if (text.empty() || plain_number_in<std::uint16_t>(text)) return std::string();
            return fmt::format(
                "is '{}'; allowed: a port from 0 to 65535, or nothing as the last word of the command", text);
        },
        "");
}

CLI::Validator one_of(std::vector<std::string> names) {
    const CLI::Validator is_member = CLI::IsMember(names);
    return CLI::Validator(
        [is_member, names](std::string& text) {
            const std::string refusal = is_member(text);
            return refusal.empty() ? refusal : refusal + nearest_hint(text, names, "; the nearest is {}");
        },
        is_member.get_description());
}

CLI::Validator bounds_name(std::span<const BoundKind> kinds) {
    std::vector<std::string> names;
    for (const BoundKind kind : kinds) names.emplace_back(name(kind));
    const CLI::Validator is_name = one_of(names);
    return CLI::Validator(
        [is_name](std::string& text) {
            if (const std::string_view instead = instead_of_bound(text); !instead.empty())
                return fmt::format("'{}' is gone; write {}", text, instead);
            return is_name(text);
        },
        is_name.get_description());
}

}  // namespace nbd
