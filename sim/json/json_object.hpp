#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace nbd {

/// Parses JSON text. Throws std::invalid_argument, one line: "line L, column C: what", for a key that an
/// object has twice its path, or for a number beyond the range of double what it is.
nlohmann::json parse_json(std::string_view text);

/// Range that a number must lie in, ends included; and how an error names it.
struct NumberRange {
    double low, high;
    const char* text;
};

/// A key that a reader of JSON asked for, whether the text has it or not.
struct JsonField {
    std::string object;  // path of the object without indices, for example `bodies[].material`
    std::string key;
    std::string type;  // as JSON schemas name it
    std::optional<NumberRange> range{};
    nlohmann::json fallback{};           // null: none
    std::vector<std::string> choices{};  // of a text; empty: any
};

/// What the reading of one JSON text came upon.
struct JsonReading {
    std::vector<std::string> problems;  // one line each
    std::vector<JsonField> fields;
};

/// A JSON object read key by key. Every problem is one line that starts with the JSON path, for example
/// `bodies[1].margin`: thrown as std::invalid_argument or, where a reading is given, noted there; the reader
/// then goes on with the fallback. Call finish() when every known key has been asked for: a key that never
/// was is a problem that names the nearest known one.
class JsonObject {
 public:
    /// path: empty for the top. value and reading must outlive the reader.
    JsonObject(const nlohmann::json& value, std::string path, JsonReading* reading = nullptr);

    /// A key that an older release had under another name, which is read still, with a notice.
    void renamed(const std::string& old, const std::string& now);

    bool has(const std::string& key);
    /// has(), and a problem where it has not.
    bool need(const std::string& key);
    /// As has() of each, and a problem unless it has exactly one of them. Returns that one, or empty.
    std::string need_one(const std::vector<std::string>& keys);

    double number(const std::string& key, double fallback, const NumberRange& range);
    /// As number(); nothing where the key is missing.
    std::optional<double> optional_number(const std::string& key, const NumberRange& range);
    /// As number(), but a whole one.
    long long integer(const std::string& key, long long fallback, const NumberRange& range);
    std::string text(const std::string& key, const std::string& fallback);
    /// A text out of a few. current: gives today's name of an old one.
    std::string choice(const std::string& key, const std::string& fallback,
                       const std::vector<std::string>& choices,
                       std::string_view (*current)(std::string_view) = nullptr);
    /// Three finite numbers.
    Eigen::Vector3d vector(const std::string& key, const Eigen::Vector3d& fallback);
    /// The object at a key; one without keys where there is none.
    JsonObject object(const std::string& key);
    /// The objects of an array; none where the key is missing.
    std::vector<JsonObject> objects(const std::string& key);

    void finish();
    /// A problem with a key; with the object itself where the key is empty.
    void problem(const std::string& key, const std::string& what) const;
    std::string path(const std::string& key) const;

 private:
    const nlohmann::json* find(const std::string& key);
    const nlohmann::json* find(JsonField field);
    void note(const std::string& problem) const;

    const nlohmann::json* value_;
    std::string path_;
    JsonReading* reading_;
    std::vector<std::string> known_;
    std::vector<std::pair<std::string, std::string>> renamed_;  // today's name, old name
};

}  // namespace nbd
