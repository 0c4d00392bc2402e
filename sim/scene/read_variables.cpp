#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include "collision/base/shortened.hpp"
#include "sim/scene/read_parts.hpp"
#include "sim/scene/scene_template.hpp"

namespace nbd {
namespace {

std::string shown_value(const nlohmann::json& value) { return shortened(value.dump(), 60); }

bool is_finite(const nlohmann::json& value) {
    return value.is_number() && std::isfinite(value.get<double>());
}

bool is_vector(const nlohmann::json& value) {
    return value.is_array() && value.size() == 3 && std::ranges::all_of(value, is_finite);
}

Eigen::Vector3d ends_of(const nlohmann::json& value) {
    if (value.is_number()) return Eigen::Vector3d::Constant(value.get<double>());
    return {value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
}

UniformLaw read_uniform(JsonObject& from, const std::string& key) {
    UniformLaw law{.is_log = key == "log_uniform"};
    const nlohmann::json& ends = *from.raw(key, "array");
    const bool is_right =
        ends.is_array() && ends.size() == 2 &&
        ((is_finite(ends[0]) && is_finite(ends[1])) || (is_vector(ends[0]) && is_vector(ends[1])));
    if (!is_right) {
        from.problem(key, fmt::format("must be [low, high], two numbers or two vectors of three, not {}",
                                      shown_value(ends)));
        return law;
    }
    law.is_vector = ends[0].is_array();
    law.low = ends_of(ends[0]);
    law.high = ends_of(ends[1]);
    if ((law.low.array() > law.high.array()).any())
        from.problem(key, fmt::format("is {}; the first must not be above the second", shown_value(ends)));
    else if (law.is_log && law.low.minCoeff() <= 0)
        from.problem(key, fmt::format("is {}, but a logarithm needs numbers above 0", shown_value(ends)));
    return law;
}

IntegerLaw read_integer(JsonObject& from) {
    constexpr long long most = 1'000'000'000'000;
    const nlohmann::json& ends = *from.raw("integer", "array");
    const auto is_end = [](const nlohmann::json& end) {
        return end.is_number_integer() && std::abs(end.get<double>()) <= static_cast<double>(most);
    };
    if (!ends.is_array() || ends.size() != 2 || !is_end(ends[0]) || !is_end(ends[1])) {
        from.problem("integer", fmt::format("must be [low, high], two whole numbers within 1e12, not {}",
                                            shown_value(ends)));
        return {};
    }
    const IntegerLaw law{ends[0].get<long long>(), ends[1].get<long long>()};
    if (law.low > law.high)
        from.problem("integer",
                     fmt::format("is {}; the first must not be above the second", shown_value(ends)));
    return law;
}

ChoiceLaw read_choice(JsonObject& from) {
    const nlohmann::json& values = *from.raw("choice", "array");
    const bool is_right = values.is_array() && !values.empty() &&
                          (std::ranges::all_of(values, is_finite) ||
                           std::ranges::all_of(values, [](const auto& value) { return value.is_string(); }));
    if (!is_right) {
        from.problem("choice",
                     fmt::format("must be a list of numbers or of texts, not {}", shown_value(values)));
        return {};
    }
    for (std::size_t i = 0; i < values.size(); ++i)
        if (std::find(values.begin(), values.begin() + i, values[i]) != values.begin() + i)
            from.problem("choice", fmt::format("has {} twice", shown_value(values[i])));
    return {values.get<std::vector<nlohmann::json>>()};
}

DirectionLaw read_direction_law(JsonObject& from) {
    const DirectionLaw any;
    return {read_direction(from, "direction", any.about),
            from.number("degrees", any.degrees, {0, 180, "between 0 and 180"})};
}

std::string read_name(JsonObject& from) {
    if (!from.need("name")) return {};
    const std::string name = from.text("name", "");
    const bool is_word = !name.empty() && std::ranges::all_of(name, [](unsigned char c) {
        return std::isalnum(c) != 0 || c == '_';
    });
    if (!is_word) from.problem("name", "must be of letters, digits and underscores");
    if (name == copy_variable) from.problem("name", "\"copy\" is the number of a copy of a body");
    return name;
}

}  // namespace

std::vector<SceneVariable> read_variables(JsonObject& from) {
    std::vector<SceneVariable> variables;
    std::set<std::string> names;
    for (JsonObject& entry : from.objects("variables")) {
        SceneVariable variable{.key = key_of(entry), .name = read_name(entry), .law = {}};
        if (!variable.name.empty() && !names.insert(variable.name).second)
            entry.problem("name", fmt::format("\"{}\" is the name of another variable", variable.name));
        const std::string kind =
            entry.need_one({"uniform", "log_uniform", "integer", "choice", "direction", "rotation"});
        if (kind == "uniform" || kind == "log_uniform") variable.law = read_uniform(entry, kind);
        if (kind == "integer") variable.law = read_integer(entry);
        if (kind == "choice") variable.law = read_choice(entry);
        if (kind == "direction") variable.law = read_direction_law(entry);
        if (kind == "rotation") {
            entry.choice("rotation", "any", {"any"});
            variable.law = RotationLaw();
        }
        variable.copies =
            static_cast<int>(entry.integer("copies", 0, {0, most_copies, "between 0 and 1000"}));
        entry.finish();
        variables.push_back(std::move(variable));
    }
    return variables;
}

}  // namespace nbd
