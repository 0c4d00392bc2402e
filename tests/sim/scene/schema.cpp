#include "tests/sim/scene/schema.hpp"

#include <cmath>
#include <fstream>
#include <map>
#include <set>

namespace nbd::test {
namespace {

using nlohmann::json;

/// The keys of a schema by their paths, with references resolved.
class SchemaKeys {
 public:
    explicit SchemaKeys(const json& schema) : root_(schema) { add(schema, ""); }
    std::map<std::string, json> keys;

 private:
    /// The schema of a value. A reference is replaced by its target, which the value's own keys override.
    json resolved(json schema) const {
        if (!schema.contains("$ref")) return schema;
        json target = root_.at(json::json_pointer(schema["$ref"].get<std::string>().substr(1)));
        schema.erase("$ref");
        target.update(schema);
        return resolved(target);
    }

    void add(const json& object, const std::string& path) {
        const json schema = resolved(object);
        if (schema.contains("items")) add(schema["items"], path + "[]");
        if (!schema.contains("properties")) return;
        for (const auto& [key, value] : schema["properties"].items()) {
            const std::string name = path.empty() ? key : path + "." + key;
            keys[name] = resolved(value);
            add(value, name);
        }
    }

    const json& root_;
};

/// What a schema should state about a field: type, range, choices, default.
json expected(const JsonField& field) {
    json schema;
    if (field.choices.empty())
        schema["type"] = field.type;
    else
        schema["enum"] = field.choices;
    if (field.range) {
        const auto [low, high, text] = *field.range;
        if (low > 0 && low < 1e-20)
            schema["exclusiveMinimum"] = 0;
        else if (low > -1e20)
            schema["minimum"] = low;
        if (high < 1e20) schema["maximum"] = high;
    }
    const bool is_plain =
        field.fallback.is_null() || field.fallback == "" ||
        (field.fallback.is_number_float() && !std::isfinite(field.fallback.get<double>())) ||
        field.fallback == json::array({0.0, 0.0, 0.0});
    if (!is_plain) schema["default"] = field.fallback;
    return schema;
}

}  // namespace

std::vector<std::string> schema_differences(const std::filesystem::path& schema,
                                            std::span<const JsonField> fields) {
    const json root = json::parse(std::ifstream(schema));
    const SchemaKeys published(root);
    std::vector<std::string> differences;
    std::set<std::string> read;
    for (const JsonField& field : fields) {
        const std::string name = field.object.empty() ? field.key : field.object + "." + field.key;
        if (!read.insert(name).second) continue;
        const auto found = published.keys.find(name);
        if (found == published.keys.end()) {
            differences.push_back(name + ": the schema lacks it");
            continue;
        }
        const json wanted = expected(field);
        for (const char* word : {"type", "enum", "minimum", "exclusiveMinimum", "maximum", "default"})
            if (wanted.value(word, json()) != found->second.value(word, json()))
                differences.push_back(name + ": " + word + " is " + found->second.value(word, json()).dump() +
                                      ", the parser has " + wanted.value(word, json()).dump());
    }
    for (const auto& [name, value] : published.keys)
        if (!read.contains(name)) differences.push_back(name + ": the parser lacks it");
    return differences;
}

}  // namespace nbd::test
