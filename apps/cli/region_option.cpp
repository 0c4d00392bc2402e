#include "apps/cli/region_option.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

namespace nbd {
namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& reason) {
    throw CLI::ValidationError("--region", fmt::format("\"{}\": {}", text, reason));
}

double number(const std::string& text, const std::string& value) {
    double result = 0;
    if (!CLI::detail::lexical_cast(value, result)) refuse(text, fmt::format("\"{}\" is not a number", value));
    return result;
}

void set(MaterialChange& change, const std::string& text, const std::string& key, const std::string& value) {
    if (key == "young")
        change.young = number(text, value);
    else if (key == "poisson")
        change.poisson = number(text, value);
    else if (key == "density")
        change.density = number(text, value);
    else if (key == "law" && material_law(value))
        change.law = material_law(value);
    else if (key == "law")
        refuse(text,
               fmt::format("law \"{}\" is not known; allowed: {}", value, fmt::join(names_of_laws(), ", ")));
    else
        refuse(text, fmt::format("key \"{}\" is not known; allowed: young, poisson, density, law", key));
}

}  // namespace

std::pair<std::string, MaterialChange> parse_region(const std::string& text) {
    const std::size_t colon = text.rfind(':');
    if (colon == text.npos || colon == 0) refuse(text, "expected NAME:key=value, such as core:young=2e6");
    MaterialChange change;
    for (const std::string& part : CLI::detail::split(text.substr(colon + 1), ',')) {
        const std::size_t equals = part.find('=');
        if (equals == part.npos) refuse(text, fmt::format("expected key=value, found \"{}\"", part));
        set(change, text, part.substr(0, equals), part.substr(equals + 1));
    }
    return {text.substr(0, colon), change};
}

std::vector<std::string> names_of_laws() {
    std::vector<std::string> names;
    for (const MaterialLaw law : material_laws) names.emplace_back(name(law));
    return names;
}

}  // namespace nbd
