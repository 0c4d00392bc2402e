#include "apps/cli/region_option.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <optional>
#include <sstream>

#include "sim/json/nearest_name.hpp"

namespace nbd {
namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& reason) {
    throw CLI::ValidationError("--region", fmt::format("\"{}\": {}", text, reason));
}

double number(const std::string& text, const std::string& value) {
    double result = 0;
    const char* const end = value.data() + value.size();
    if (const auto read = std::from_chars(value.data(), end, result);
        read.ec != std::errc() || read.ptr != end)
        refuse(text, fmt::format("\"{}\" is not a number", value));
    return result;
}

void set(MaterialChange& change, const std::string& text, const std::string& key, const std::string& value) {
    std::optional<double>* const constant = key == "young"     ? &change.young
                                            : key == "poisson" ? &change.poisson
                                            : key == "density" ? &change.density
                                                               : nullptr;
    if (!constant && key != "law")
        refuse(text,
               fmt::format("key \"{}\" is not known; allowed: young, poisson, density, law{}", key,
                           nearest_hint(key, {"young", "poisson", "density", "law"}, "; the nearest is {}")));
    if (constant ? constant->has_value() : change.law.has_value())
        refuse(text, fmt::format("key \"{}\" occurs twice", key));
    if (constant) {
        *constant = number(text, value);
        return;
    }
    change.law = material_law(value);
    if (!change.law)
        refuse(text,
               fmt::format("law \"{}\" is not known; allowed: {}{}", value, fmt::join(names_of_laws(), ", "),
                           nearest_hint(value, names_of_laws(), "; the nearest is {}")));
}

}  // namespace

std::pair<std::string, MaterialChange> parse_region(const std::string& text) {
    const std::size_t colon = text.rfind(':');
    if (colon == text.npos || colon == 0) refuse(text, "expected NAME:key=value, such as core:young=2e6");
    MaterialChange change;
    std::istringstream parts(text.substr(colon + 1));
    for (std::string part; std::getline(parts, part, ',');) {
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
