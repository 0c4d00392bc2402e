#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace nbd {

/// Parses JSON text. Throws std::invalid_argument, one line: "line L, column C: what", or for a
/// number beyond the range of double what it is.
nlohmann::json parse_json(std::string_view text);

/// Range that a number must lie in, ends included; and how an error names it.
struct NumberRange {
    double low, high;
    const char* text;
};

/// A JSON object read key by key. Every problem is a std::invalid_argument of one line that starts with the
/// JSON path, for example `bodies[1].margin`. Call finish() when every known key has been asked for: a key
/// that never was is an error that names the nearest known one.
class JsonObject {
 public:
    /// path: empty for the top. The value must outlive the reader.
    JsonObject(const nlohmann::json& value, std::string path);

    bool has(const std::string& key);
    double number(const std::string& key, double fallback, const NumberRange& range);
    /// As number(), but a whole one.
    long long integer(const std::string& key, long long fallback, const NumberRange& range);
    std::string text(const std::string& key, const std::string& fallback);
    /// Three finite numbers.
    Eigen::Vector3d vector(const std::string& key, const Eigen::Vector3d& fallback);
    /// The object at a key; one without keys where there is none.
    JsonObject object(const std::string& key);
    /// The objects of an array; none where the key is missing.
    std::vector<JsonObject> objects(const std::string& key);

    void finish() const;
    [[noreturn]] void fail(const std::string& key, const std::string& what) const;
    std::string path(const std::string& key) const;

 private:
    const nlohmann::json* find(const std::string& key);

    const nlohmann::json* value_;
    std::string path_;
    std::vector<std::string> known_;
};

}  // namespace nbd
