#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "sim/json/nearest_name.hpp"
#include "sim/scene/read_parts.hpp"

namespace nbd {
namespace {

int find_name(const JsonObject& from, const std::string& key, const std::string& name,
              const std::vector<std::string>& names, const char* what) {
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) {
        std::string all;
        for (const std::string& one : names) all += (all.empty() ? "" : ", ") + one;
        from.problem(key, fmt::format("no {} is named \"{}\"; allowed: {}{}", what, name,
                                      all.empty() ? "none, there are none" : all,
                                      nearest_hint(name, names, "; the nearest is \"{}\"")));
        return 0;
    }
    if (std::ranges::count(names, name) > 1)
        from.problem(key, fmt::format("several have the name \"{}\"; give each a \"name\" of its own", name));
    return found - names.begin();
}

ScenePair read_pair(JsonObject& from, const SceneNames& names) {
    ScenePair pair{.key = from.path(""), .a = 0, .b = 0, .rule = {}};
    const std::string kind = from.need_one({"bodies", "body"});
    if (kind == "bodies") {
        const std::vector<std::string> two = from.texts("bodies", 2);
        if (!two.empty()) {
            pair.a = names.body(from, "bodies", two[0]);
            pair.b = names.body(from, "bodies", two[1]);
        }
    }
    const std::string body = from.text("body", ""), obstacle = from.text("obstacle", "");
    if (kind == "body" && from.need("obstacle")) {
        pair.a = names.body(from, "body", body);
        pair.b = party_of_obstacle(names.obstacle(from, "obstacle", obstacle));
    }
    if (kind == "bodies" && from.has("obstacle")) from.problem("obstacle", "must be beside \"body\" alone");
    pair.rule.meets = from.flag("meet", pair.rule.meets);
    pair.rule.friction = from.optional_number("friction", {0, 10, "between 0 and 10"});
    if (!from.has("meet") && !from.has("friction"))
        from.problem("", "says nothing of the two; needs \"meet\" or \"friction\"");
    if (!pair.rule.meets && from.has("friction"))
        from.problem("friction", "has no meaning for what does not \"meet\"");
    from.finish();
    return pair;
}

}  // namespace

SceneNames::SceneNames(const SceneSpec& spec) {
    for (const SceneBody& body : spec.bodies) bodies_.push_back(body.name);
    for (const SceneObstacle& obstacle : spec.obstacles) obstacles_.push_back(obstacle.name);
}

int SceneNames::body(const JsonObject& from, const std::string& key, const std::string& name) const {
    return find_name(from, key, name, bodies_, "body");
}

int SceneNames::obstacle(const JsonObject& from, const std::string& key, const std::string& name) const {
    return find_name(from, key, name, obstacles_, "obstacle");
}

std::vector<ScenePair> read_pairs(JsonObject& contact, const SceneSpec& spec) {
    const SceneNames names(spec);
    std::vector<ScenePair> pairs;
    std::map<std::pair<int, int>, std::string> named;  // by which entry
    for (JsonObject& from : contact.objects("pairs")) {
        const ScenePair& pair = pairs.emplace_back(read_pair(from, names));
        const auto [known, is_new] = named.try_emplace(std::minmax(pair.a, pair.b), pair.key);
        if (!is_new && (from.has("bodies") || from.has("body")))
            from.problem("", fmt::format("names the same two as {}", known->second));
    }
    return pairs;
}

}  // namespace nbd
