#include "apps/dataset/hold_out.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "apps/dataset/scene_trajectories.hpp"
#include "meshing/formats/words.hpp"
#include "meshing/surface/counted.hpp"

namespace nbd {
namespace {

using Json = nlohmann::ordered_json;

[[noreturn]] void refuse(const std::string& text) {
    throw std::invalid_argument(
        fmt::format("hold-out rule \"{}\"; allowed: PARAMETER=NAME,NAME or PARAMETER=FROM..TO or "
                    "PARAMETER=top:SHARE or PARAMETER=bottom:SHARE with a share between 0 and 1",
                    text));
}

std::optional<double> number(std::string_view text) {
    const auto value = plain_number_in<double>(text);
    return value && std::isfinite(*value) ? value : std::nullopt;
}

/// The end of a range; may be missing.
double limit(const std::string& text, std::string_view end, double missing) {
    if (end.empty()) return missing;
    const std::optional<double> value = number(end);
    if (!value) refuse(text);
    return *value;
}

/// Norm of the numbers in a vector or matrix; nullopt if there is anything else.
std::optional<double> norm(const Json& list) {
    double squares = 0;
    for (const Json& item : list) {
        const auto value = item.is_array()    ? norm(item)
                           : item.is_number() ? std::optional(item.get<double>())
                                              : std::nullopt;
        if (!value) return {};
        squares += *value * *value;
    }
    return std::sqrt(squares);
}

std::optional<ParameterValue> value_at(const Json& json, std::string_view path) {
    if (path.empty()) {
        if (json.is_string()) return json.get<std::string>();
        if (json.is_number()) return json.get<double>();
        if (json.is_array() && !json.empty())
            if (const auto size = norm(json)) return *size;
        return {};
    }
    if (json.is_array()) {
        std::optional<ParameterValue> largest;
        for (const Json& item : json)
            if (auto value = value_at(item, path); value && (!largest || *largest < *value))
                largest = std::move(value);
        return largest;
    }
    const std::size_t dot = path.find('.');
    const std::string key(path.substr(0, dot));
    if (!json.is_object() || !json.contains(key)) return {};
    return value_at(json[key], dot == std::string_view::npos ? "" : path.substr(dot + 1));
}

/// Sets the limit at which the top or bottom share of the values begins. Equal values stay together.
void set_limit(HoldOutRule& rule, std::vector<double> values) {
    std::ranges::sort(values);
    const auto count = [&](double share) {
        const double all = values.size();
        return std::clamp(std::round(share * all), 1.0, all);
    };
    if (rule.top) rule.from = values[values.size() - count(*rule.top)];
    if (rule.bottom) rule.to = values[count(*rule.bottom) - 1];
}

bool holds_out(const HoldOutRule& rule, const std::optional<ParameterValue>& value) {
    if (!value) return false;
    if (const auto* name = std::get_if<std::string>(&*value))
        return std::ranges::find(rule.names, *name) != rule.names.end();
    const double x = std::get<double>(*value);
    return rule.names.empty() && x >= rule.from && x <= rule.to;
}

std::string described(const HoldOutRule& rule) {
    Json json{{"rule", rule.text}, {"parameter", rule.parameter}};
    if (!rule.names.empty()) {
        json["names"] = rule.names;
    } else {
        json["from"] = std::isfinite(rule.from) ? Json(rule.from) : Json();
        json["to"] = std::isfinite(rule.to) ? Json(rule.to) : Json();
    }
    return json.dump();
}

}  // namespace

HoldOutRule parse_hold_out(const std::string& text) {
    const std::size_t sign = text.find('=');
    if (sign == std::string::npos || sign == 0 || sign + 1 == text.size()) refuse(text);
    HoldOutRule rule{.text = text, .parameter = text.substr(0, sign)};
    const std::string_view values = std::string_view(text).substr(sign + 1);
    for (auto [word, share] : {std::pair("top:", &rule.top), std::pair("bottom:", &rule.bottom)})
        if (values.starts_with(word)) {
            *share = number(values.substr(std::string_view(word).size()));
            if (!*share || !(**share > 0 && **share < 1)) refuse(text);
            return rule;
        }
    if (const std::size_t dots = values.find(".."); dots != std::string_view::npos) {
        rule.from = limit(text, values.substr(0, dots), rule.from);
        rule.to = limit(text, values.substr(dots + 2), rule.to);
        if (values == ".." || rule.from > rule.to) refuse(text);
        return rule;
    }
    for (std::size_t begin = 0; begin <= values.size();) {
        const std::size_t end = std::min(values.find(',', begin), values.size());
        if (end == begin) refuse(text);
        rule.names.emplace_back(values.substr(begin, end - begin));
        begin = end + 1;
    }
    return rule;
}

std::optional<ParameterValue> recipe_parameter(const std::string& recipe, const std::string& parameter) {
    const Json json = Json::parse(recipe, nullptr, false);
    return json.is_object() ? value_at(json, parameter) : std::nullopt;
}

DatasetSplit split_by_parameter(const HoldOutRule& rule, const std::map<int, std::string>& recipes) {
    std::map<int, std::optional<ParameterValue>> values;
    std::vector<double> numbers;
    for (const auto& [id, recipe] : recipes) {
        values[id] = recipe_parameter(recipe, rule.parameter);
        if (values[id] && std::holds_alternative<double>(*values[id]))
            numbers.push_back(std::get<double>(*values[id]));
    }
    const auto refuse_parts = [&](std::size_t held_out) {
        throw std::invalid_argument(
            fmt::format("hold-out rule \"{}\" holds out {} of {}; allowed: some, but not all", rule.text,
                        held_out, counted_trajectories(recipes.size())));
    };
    HoldOutRule limited = rule;
    if (rule.top || rule.bottom) {
        if (numbers.empty()) refuse_parts(0);
        set_limit(limited, std::move(numbers));
    }
    DatasetSplit split{.name = parameter_split, .train = {}, .held_out = {}, .rule = described(limited)};
    for (const auto& [id, value] : values)
        (holds_out(limited, value) ? split.held_out : split.train).push_back(id);
    if (split.train.empty() || split.held_out.empty()) refuse_parts(split.held_out.size());
    return split;
}

void check_hold_out(const DatasetPlan& plan, const Body& body) {
    if (plan.hold_out.empty()) return;
    const HoldOutRule rule = parse_hold_out(plan.hold_out);
    std::map<int, std::string> recipes;
    if (plan.scene) {
        for (int i = 0; i < plan.trajectories; ++i) recipes[i] = plan.scene->recipe(i);
    } else {
        const RecipeBook book(std::make_shared<const Body>(body), plan.excitation);
        for (int i = 0; i < plan.trajectories; ++i) recipes[i] = recipe_json(book.draw(i));
    }
    split_by_parameter(rule, recipes);
}

}  // namespace nbd
