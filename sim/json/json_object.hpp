#pragma once

#include <Eigen/Core>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace nbd {

/// Parses JSON text. Throws a one-line std::invalid_argument: "line L, column C: what"; for a duplicate key,
/// its path; for a number beyond the range of double, its value.
nlohmann::json parse_json(std::string_view text);

/// The text with its comments, // to the end of a line and /* ... */, replaced by spaces, so that lines and
/// columns stay; the text itself where it has none. Throws std::invalid_argument for one that does not end.
std::string without_comments(std::string_view text);

/// Allowed range of a number, ends included, and its name in error messages.
struct NumberRange {
    double low, high;
    const char* text;
};

/// A key that a reader asked for, present in the text or not.
struct JsonField {
    std::string object;  // path of the object without indices, for example `bodies[].material`
    std::string key;
    std::string type;  // type name of JSON schemas
    std::optional<NumberRange> range{};
    nlohmann::json fallback{};           // null: no fallback
    std::vector<std::string> choices{};  // allowed texts; empty: any
};

/// Problems and requested keys of one JSON text.
struct JsonReading {
    std::vector<std::string> problems;  // one line each
    std::vector<JsonField> fields;
};

/// Reads a JSON object key by key. Every problem is one line that starts with the JSON path, for example
/// `bodies[1].margin`. It is thrown as std::invalid_argument; with a JsonReading it is stored there instead,
/// and reading continues with the fallback. Call finish() after asking for every known key: it reports each
/// unknown key with the nearest known one.
class JsonObject {
 public:
    /// path: empty at the top level. value and reading must outlive this object.
    JsonObject(const nlohmann::json& value, std::string path, JsonReading* reading = nullptr);

    /// Declares a key that is gone, and the key to write instead, which finish() names.
    void gone(const std::string& key, const std::string& instead);

    bool has(const std::string& key);
    /// Like has(), but a missing key is a problem.
    bool need(const std::string& key);
    /// Returns which one of the keys is present. None or several present is a problem and returns an empty
    /// text.
    std::string need_one(const std::vector<std::string>& keys);

    double number(const std::string& key, double fallback, const NumberRange& range);
    /// Like number(); nullopt if the key is missing.
    std::optional<double> optional_number(const std::string& key, const NumberRange& range);
    /// Like number(), for whole numbers.
    long long integer(const std::string& key, long long fallback, const NumberRange& range);
    bool flag(const std::string& key, bool fallback);
    std::string text(const std::string& key, const std::string& fallback);
    /// An array of so many texts; none if the key is missing or after a problem.
    std::vector<std::string> texts(const std::string& key, std::size_t count);
    /// One text out of `choices`. instead_of: what to write instead of a text that is gone, else empty.
    std::string choice(const std::string& key, const std::string& fallback,
                       const std::vector<std::string>& choices,
                       std::string_view (*instead_of)(std::string_view) noexcept = nullptr);
    /// Three finite numbers.
    Eigen::Vector3d vector(const std::string& key, const Eigen::Vector3d& fallback);
    /// An array of pairs of finite numbers; none if the key is missing or after a problem.
    std::vector<std::pair<double, double>> number_pairs(const std::string& key);
    /// Whether the value is an array of one object or more, for keys that take several forms.
    bool holds_objects(const std::string& key);
    /// Rows of finite numbers; none if the key is missing or wrong.
    std::vector<std::vector<double>> table(const std::string& key);
    /// The value at a key as it is, for keys with forms of their own; null if the key is missing. type: its
    /// name in JSON schemas.
    const nlohmann::json* raw(const std::string& key, const std::string& type);
    /// The object at a key; an object without keys if the key is missing.
    JsonObject object(const std::string& key);
    /// The objects of an array; none if the key is missing.
    std::vector<JsonObject> objects(const std::string& key);

    void finish();
    /// Reports a problem with a key, or with the object itself if the key is empty.
    void problem(const std::string& key, const std::string& what) const;
    std::string path(const std::string& key) const;

 private:
    const nlohmann::json* find(const std::string& key);
    const nlohmann::json* find(JsonField field);
    const nlohmann::json* find(JsonField field, bool (nlohmann::json::*is_right)() const noexcept,
                               const char* what);
    void note(const std::string& problem) const;

    const nlohmann::json* value_;
    std::string path_;
    JsonReading* reading_;
    std::vector<std::string> known_;
    std::map<std::string, std::string> gone_;  // key to write instead
};

}  // namespace nbd
