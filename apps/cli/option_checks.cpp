#include "apps/cli/option_checks.hpp"

#include <utility>

#include "sim/json/nearest_name.hpp"

namespace nbd {

CLI::Validator one_of(std::vector<std::string> names) {
    const CLI::Validator is_member = CLI::IsMember(names);
    return CLI::Validator(
        [is_member, names](std::string& text) {
            const std::string refusal = is_member(text);
            return refusal.empty() ? refusal
                                   : fmt::format("{}; the nearest is {}", refusal, nearest_name(text, names));
        },
        is_member.get_description());
}

CLI::Validator bounds_name(std::span<const BoundKind> kinds) {
    std::vector<std::string> names;
    for (const BoundKind kind : kinds) names.emplace_back(name(kind));
    const CLI::Validator is_name = one_of(names);
    return CLI::Validator(
        [is_name](std::string& text) {
            std::string now(current_bound_name(text));
            return is_name(now);
        },
        is_name.get_description());
}

}  // namespace nbd
