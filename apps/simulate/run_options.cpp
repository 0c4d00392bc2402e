#include "apps/simulate/run_options.hpp"

#include <fmt/format.h>

#include <sstream>

namespace nbd {
namespace {

/// Value of an option in a text of run_options_text(); empty if the text lacks it.
std::string stored_value(const std::string& stored, const std::string& name) {
    std::istringstream words(stored);
    for (std::string word; words >> word;)
        if (word.starts_with(name) && word.size() > name.size() && word[name.size()] == '=')
            return word.substr(name.size() + 1);
    return {};
}

std::string as_typed(const std::string& name, const std::string& value) {
    return value.empty() ? fmt::format("no {}", name) : fmt::format("{} {}", name, value);
}

}  // namespace

std::string run_options_text(const RunOptions& options) {
    std::string text;
    for (const auto& [name, value] : options)
        text += fmt::format("{}{}={}", text.empty() ? "" : " ", name, value);
    return text;
}

std::string differing_option(const std::string& stored, const RunOptions& options) {
    for (const auto& [name, value] : options)
        if (const std::string there = stored_value(stored, name); there != value)
            return fmt::format("{} instead of {}", as_typed(name, there), as_typed(name, value));
    return {};
}

std::string given_options(const RunOptions& options) {
    std::string names;
    for (const auto& [name, value] : options)
        if (!value.empty()) names += fmt::format("{}{}", names.empty() ? "" : ", ", name);
    return names;
}

}  // namespace nbd
