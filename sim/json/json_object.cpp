#include "sim/json/json_object.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "collision/base/shortened.hpp"
#include "sim/json/nearest_name.hpp"

namespace nbd {
namespace {

const nlohmann::json empty_object = nlohmann::json::object();

/// A short one-line form of a value for messages.
std::string shown(const nlohmann::json& value) {
    return shortened(value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace), 40);
}

/// A path without array indices.
std::string without_indices(std::string_view path) {
    std::string result;
    bool inside = false;
    for (const char c : path) {
        if (c == ']') inside = false;
        if (!inside) result += c;
        if (c == '[') inside = true;
    }
    return result;
}

std::string joined(const std::vector<std::string>& words, std::string_view before_last) {
    std::string result;
    for (std::size_t i = 0; i < words.size(); ++i)
        result += (i == 0 ? "" : i + 1 == words.size() ? std::string(before_last) : ", ") + words[i];
    return result;
}

/// Names the first key of the object, not one of `known`, that may stand for one of `missing`; empty if there
/// is none.
std::string mistyped_hint(const nlohmann::json& object, const std::vector<std::string>& known,
                          const std::vector<std::string>& missing) {
    for (const auto& [key, value] : object.items())
        if (std::ranges::find(known, key) == known.end() && !nearest_name(key, missing).empty())
            return fmt::format("; the nearest key there is {}", shown(nlohmann::json(key)));
    return {};
}

}  // namespace

JsonObject::JsonObject(const nlohmann::json& value, std::string path, JsonReading* reading)
    : value_(&value), path_(std::move(path)), reading_(reading) {
    if (value.is_object()) return;
    note(fmt::format("{}must be an object, not {}", path_.empty() ? "the scene " : path_ + ": ",
                     shown(value)));
    value_ = &empty_object;
}

std::string JsonObject::path(const std::string& key) const {
    return path_.empty() || key.empty() ? path_ + key : path_ + "." + key;
}

void JsonObject::note(const std::string& problem) const {
    if (!reading_) throw std::invalid_argument(problem);
    reading_->problems.push_back(problem);
}

void JsonObject::problem(const std::string& key, const std::string& what) const {
    note(fmt::format("{}: {}", path(key), what));
}

const nlohmann::json* JsonObject::find(const std::string& key) {
    if (std::ranges::find(known_, key) == known_.end()) known_.push_back(key);
    const auto entry = value_->find(key);
    return entry != value_->end() ? &*entry : nullptr;
}

void JsonObject::gone(const std::string& key, const std::string& instead) { gone_[key] = instead; }

const nlohmann::json* JsonObject::raw(const std::string& key, const std::string& type) {
    return find({.object = {}, .key = key, .type = type});
}

const nlohmann::json* JsonObject::find(JsonField field) {
    const nlohmann::json* entry = find(field.key);
    if (reading_) {
        field.object = without_indices(path_);
        reading_->fields.push_back(std::move(field));
    }
    return entry;
}

bool JsonObject::has(const std::string& key) { return find(key) != nullptr; }

bool JsonObject::need(const std::string& key) {
    if (has(key)) return true;
    problem(key, "is missing" + mistyped_hint(*value_, known_, {key}));
    return false;
}

std::string JsonObject::need_one(const std::vector<std::string>& keys) {
    std::vector<std::string> there, quoted;
    for (const std::string& key : keys) {
        if (has(key)) there.push_back(key);
        quoted.push_back('"' + key + '"');
    }
    if (there.size() == 1) return there.front();
    problem("", fmt::format("needs exactly one of {}{}", joined(quoted, " and "),
                            there.empty() ? mistyped_hint(*value_, known_, keys) : ""));
    return {};
}

/// The value at a field's key; null if it is missing, or after a problem that says what it must be.
const nlohmann::json* JsonObject::find(JsonField field, bool (nlohmann::json::*is_right)() const noexcept,
                                       const char* what) {
    const std::string key = field.key;
    const nlohmann::json* entry = find(std::move(field));
    if (!entry || (entry->*is_right)()) return entry;
    problem(key, fmt::format("must be {}, not {}", what, shown(*entry)));
    return nullptr;
}

double JsonObject::number(const std::string& key, double fallback, const NumberRange& range) {
    const nlohmann::json* entry =
        find({.object = {}, .key = key, .type = "number", .range = range, .fallback = fallback},
             &nlohmann::json::is_number, "a number");
    if (!entry) return fallback;
    const double value = entry->get<double>();
    if (value >= range.low && value <= range.high && std::isfinite(value)) return value;
    problem(key, fmt::format("is {}, but must be {}", value, range.text));
    return fallback;
}

std::optional<double> JsonObject::optional_number(const std::string& key, const NumberRange& range) {
    const double none = std::numeric_limits<double>::infinity(), value = number(key, none, range);
    return value == none ? std::nullopt : std::optional(value);
}

long long JsonObject::integer(const std::string& key, long long fallback, const NumberRange& range) {
    const nlohmann::json* entry =
        find({.object = {}, .key = key, .type = "integer", .range = range, .fallback = fallback},
             &nlohmann::json::is_number_integer, "a whole number");
    if (!entry) return fallback;
    const double value = entry->get<double>();
    if (value >= range.low && value <= range.high) return entry->get<long long>();
    problem(key, fmt::format("is {}, but must be {}", shown(*entry), range.text));
    return fallback;
}

bool JsonObject::flag(const std::string& key, bool fallback) {
    const nlohmann::json* entry = find({.object = {}, .key = key, .type = "boolean", .fallback = fallback},
                                       &nlohmann::json::is_boolean, "true or false");
    return entry ? entry->get<bool>() : fallback;
}

std::string JsonObject::text(const std::string& key, const std::string& fallback) {
    const nlohmann::json* entry = find({.object = {}, .key = key, .type = "string", .fallback = fallback},
                                       &nlohmann::json::is_string, "a text");
    if (!entry) return fallback;
    auto text = entry->get<std::string>();
    if (std::ranges::none_of(text, [](unsigned char c) { return std::iscntrl(c) != 0; })) return text;
    problem(key, "must not hold control characters");
    return fallback;
}

std::vector<std::string> JsonObject::texts(const std::string& key, std::size_t count) {
    const nlohmann::json* entry = find({.object = {}, .key = key, .type = "array"});
    if (!entry) return {};
    if (entry->is_array() && entry->size() == count &&
        std::ranges::all_of(*entry, [](const auto& text) { return text.is_string(); }))
        return entry->get<std::vector<std::string>>();
    problem(key, fmt::format("must be {} texts, not {}", count, shown(*entry)));
    return {};
}

std::string JsonObject::choice(const std::string& key, const std::string& fallback,
                               const std::vector<std::string>& choices,
                               std::string_view (*instead_of)(std::string_view) noexcept) {
    const nlohmann::json* entry =
        find({.object = {}, .key = key, .type = "string", .fallback = fallback, .choices = choices});
    if (!entry) return fallback;
    if (entry->is_string()) {
        const auto& text = entry->get_ref<const std::string&>();
        if (std::ranges::find(choices, text) != choices.end()) return text;
        if (const std::string_view instead = instead_of ? instead_of(text) : ""; !instead.empty()) {
            problem(key, fmt::format("is {}, which is gone; write \"{}\"", shown(*entry), instead));
            return fallback;
        }
    }
    problem(key, fmt::format("is {}, but must be {}{}", shown(*entry), joined(choices, " or "),
                             entry->is_string()
                                 ? nearest_hint(entry->get<std::string>(), choices, "; the nearest is \"{}\"")
                                 : ""));
    return fallback;
}

Eigen::Vector3d JsonObject::vector(const std::string& key, const Eigen::Vector3d& fallback) {
    const nlohmann::json* entry =
        find({.object = {},
              .key = key,
              .type = "array",
              .fallback = nlohmann::json::array({fallback.x(), fallback.y(), fallback.z()})});
    if (!entry) return fallback;
    const bool three = entry->is_array() && entry->size() == 3 &&
                       std::ranges::all_of(*entry, [](const auto& c) { return c.is_number(); });
    if (!three) {
        problem(key, fmt::format("must be three numbers, not {}", shown(*entry)));
        return fallback;
    }
    const Eigen::Vector3d value((*entry)[0].get<double>(), (*entry)[1].get<double>(),
                                (*entry)[2].get<double>());
    constexpr double most = 1e30;
    if (value.cwiseAbs().maxCoeff() <= most) return value;
    problem(key, "must be between -1e30 and 1e30");
    return fallback;
}

std::vector<std::pair<double, double>> JsonObject::number_pairs(const std::string& key) {
    const nlohmann::json* entry = find({.object = {}, .key = key, .type = "array"});
    if (!entry) return {};
    std::vector<std::pair<double, double>> pairs;
    const auto is_pair = [](const nlohmann::json& pair) {
        return pair.is_array() && pair.size() == 2 && pair[0].is_number() && pair[1].is_number();
    };
    if (!entry->is_array() || entry->empty() || !std::ranges::all_of(*entry, is_pair)) {
        problem(key, fmt::format("must be pairs of numbers, not {}", shown(*entry)));
        return {};
    }
    for (const auto& pair : *entry) pairs.emplace_back(pair[0].get<double>(), pair[1].get<double>());
    return pairs;
}

bool JsonObject::holds_objects(const std::string& key) {
    const nlohmann::json* entry = find(key);
    return entry && entry->is_array() && !entry->empty() && entry->front().is_object();
}

std::vector<std::vector<double>> JsonObject::table(const std::string& key) {
    const nlohmann::json* entry =
        find({.object = {}, .key = key, .type = "array"}, &nlohmann::json::is_array, "an array");
    std::vector<std::vector<double>> rows;
    for (std::size_t i = 0; entry && i < entry->size(); ++i) {
        const nlohmann::json& row = (*entry)[i];
        const bool is_right = row.is_array() && std::ranges::all_of(row, [](const auto& number) {
                                  return number.is_number() && std::isfinite(number.template get<double>());
                              });
        if (!is_right) {
            problem(key, fmt::format("row {} must be finite numbers, not {}", i, shown(row)));
            return {};
        }
        rows.push_back(row.get<std::vector<double>>());
    }
    return rows;
}

JsonObject JsonObject::object(const std::string& key) {
    const nlohmann::json* entry = find({.object = {}, .key = key, .type = "object"});
    return {entry ? *entry : empty_object, path(key), reading_};
}

std::vector<JsonObject> JsonObject::objects(const std::string& key) {
    const nlohmann::json* entry =
        find({.object = {}, .key = key, .type = "array"}, &nlohmann::json::is_array, "an array");
    std::vector<JsonObject> result;
    for (std::size_t i = 0; entry && i < entry->size(); ++i)
        result.emplace_back((*entry)[i], fmt::format("{}[{}]", path(key), i), reading_);
    return result;
}

void JsonObject::finish() {
    for (const auto& [key, value] : value_->items()) {
        if (std::ranges::find(known_, key) != known_.end()) continue;
        if (const auto found = gone_.find(key); found != gone_.end()) {
            problem(key, fmt::format("is gone; write \"{}\"", found->second));
            continue;
        }
        note(fmt::format("{}unknown key {}{}", path_.empty() ? "" : path_ + ": ", shown(nlohmann::json(key)),
                         nearest_hint(key, known_, "; the nearest known one is \"{}\"")));
    }
}

}  // namespace nbd
