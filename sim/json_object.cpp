#include "sim/json_object.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace nbd {
namespace {

const nlohmann::json empty_object = nlohmann::json::object();

/// Fewest single-letter insertions, deletions and replacements that turn a into b.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = std::exchange(row[0], i + 1);
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
            diagonal = row[j + 1];
            row[j + 1] = std::min({replaced, diagonal + 1, row[j] + 1});
        }
    }
    return row.back();
}

/// A short, one-line rendering of a value for messages.
std::string shown(const nlohmann::json& value) {
    std::string text = value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
    if (text.size() > 40) text = text.substr(0, 37) + "...";
    return text;
}

}  // namespace

nlohmann::json parse_json(std::string_view text) {
    try {
        return nlohmann::json::parse(text);
    } catch (const nlohmann::json::parse_error& error) {
        const auto before = text.substr(0, std::min(text.size(), error.byte > 0 ? error.byte - 1 : 0));
        const auto line = 1 + std::ranges::count(before, '\n');
        const auto line_start = before.rfind('\n');
        const std::size_t column =
            before.size() - (line_start == std::string_view::npos ? 0 : line_start + 1) + 1;
        std::string what = error.what();
        if (const auto detail = what.rfind(": ");
            detail != std::string::npos && what.find("syntax error") < detail)
            what = what.substr(what.find("syntax error"));
        std::ranges::replace(what, '\n', ' ');
        throw std::invalid_argument(fmt::format("line {}, column {}: {}", line, column, what));
    } catch (const nlohmann::json::out_of_range& error) {  // a number beyond double's range; has no position
        const std::string_view what = error.what();
        throw std::invalid_argument(std::string(what.substr(std::min(what.find("] "), what.size() - 2) + 2)));
    }
}

JsonObject::JsonObject(const nlohmann::json& value, std::string path)
    : value_(&value), path_(std::move(path)) {
    if (!value.is_object())
        throw std::invalid_argument(fmt::format("{}must be an object, not {}",
                                                path_.empty() ? "the scene " : path_ + ": ", shown(value)));
}

std::string JsonObject::path(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }

void JsonObject::fail(const std::string& key, const std::string& what) const {
    throw std::invalid_argument(fmt::format("{}: {}", path(key), what));
}

const nlohmann::json* JsonObject::find(const std::string& key) {
    known_.push_back(key);
    const auto entry = value_->find(key);
    return entry == value_->end() ? nullptr : &*entry;
}

bool JsonObject::has(const std::string& key) { return find(key) != nullptr; }

double JsonObject::number(const std::string& key, double fallback, const NumberRange& range) {
    const nlohmann::json* entry = find(key);
    if (!entry) return fallback;
    if (!entry->is_number()) fail(key, fmt::format("must be a number, not {}", shown(*entry)));
    const double value = entry->get<double>();
    if (!(value >= range.low && value <= range.high) || !std::isfinite(value))
        fail(key, fmt::format("is {}, but must be {}", value, range.text));
    return value;
}

long long JsonObject::integer(const std::string& key, long long fallback, const NumberRange& range) {
    const nlohmann::json* entry = find(key);
    if (!entry) return fallback;
    if (!entry->is_number_integer()) fail(key, fmt::format("must be a whole number, not {}", shown(*entry)));
    const double value = entry->get<double>();
    if (!(value >= range.low && value <= range.high))
        fail(key, fmt::format("is {}, but must be {}", shown(*entry), range.text));
    return entry->get<long long>();
}

std::string JsonObject::text(const std::string& key, const std::string& fallback) {
    const nlohmann::json* entry = find(key);
    if (!entry) return fallback;
    if (!entry->is_string()) fail(key, fmt::format("must be a text, not {}", shown(*entry)));
    return entry->get<std::string>();
}

Eigen::Vector3d JsonObject::vector(const std::string& key, const Eigen::Vector3d& fallback) {
    const nlohmann::json* entry = find(key);
    if (!entry) return fallback;
    const bool three = entry->is_array() && entry->size() == 3 &&
                       std::ranges::all_of(*entry, [](const auto& c) { return c.is_number(); });
    if (!three) fail(key, fmt::format("must be three numbers, not {}", shown(*entry)));
    const Eigen::Vector3d value((*entry)[0].get<double>(), (*entry)[1].get<double>(),
                                (*entry)[2].get<double>());
    if (!value.allFinite()) fail(key, "must be finite");
    return value;
}

JsonObject JsonObject::object(const std::string& key) {
    const nlohmann::json* entry = find(key);
    return {entry ? *entry : empty_object, path(key)};
}

std::vector<JsonObject> JsonObject::objects(const std::string& key) {
    const nlohmann::json* entry = find(key);
    std::vector<JsonObject> result;
    if (!entry) return result;
    if (!entry->is_array()) fail(key, fmt::format("must be an array, not {}", shown(*entry)));
    for (std::size_t i = 0; i < entry->size(); ++i)
        result.emplace_back((*entry)[i], fmt::format("{}[{}]", path(key), i));
    return result;
}

void JsonObject::finish() const {
    for (const auto& [key, value] : value_->items()) {
        if (std::ranges::find(known_, key) != known_.end()) continue;
        const auto nearest = std::ranges::min_element(
            known_, {}, [&](const std::string& known) { return edit_distance(key, known); });
        const std::string name = shown(nlohmann::json(key));
        throw std::invalid_argument(fmt::format("{}unknown key {}; the nearest known one is \"{}\"",
                                                path_.empty() ? "" : path_ + ": ", name, *nearest));
    }
}

}  // namespace nbd
