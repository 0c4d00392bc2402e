#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "sim/scene/read_parts.hpp"

namespace nbd {
namespace {

struct Needless {
    const char *key, *why;
};

/// Makes a problem of each of these keys in an object. path: of the object.
void refuse(const nlohmann::json& object, const std::string& path, std::initializer_list<Needless> keys,
            JsonReading& reading) {
    if (!object.is_object()) return;
    for (const auto& [key, why] : keys)
        if (object.contains(key))
            reading.problems.push_back(
                fmt::format("{}.{}: has no sense in a static scene: {}", path, key, why));
}

/// Calls act(entry, path) for the objects in the array at a key.
template <class Act>
void for_entries(const nlohmann::json& scene, const char* key, const Act& act) {
    const auto list = scene.find(key);
    if (list == scene.end() || !list->is_array()) return;
    for (std::size_t i = 0; i < list->size(); ++i)
        if ((*list)[i].is_object()) act((*list)[i], fmt::format("{}[{}]", key, i));
}

/// The time of an entry of a list of keys: [time, value], or an object with a "time"; none of others.
std::optional<double> time_of_key(const nlohmann::json& entry, const std::string& key) {
    const bool has_pairs = key == "factor" || key == "motor" || key == "winch";
    if (has_pairs && entry.is_array() && entry.size() == 2 && entry[0].is_number())
        return entry[0].get<double>();
    if (entry.is_object() && entry.contains("time") && entry["time"].is_number())
        return entry["time"].get<double>();
    return std::nullopt;
}

/// Makes a problem of each list of keys in a part of the scene that goes on after the whole load.
void refuse_late_keys(const nlohmann::json& part, const std::string& path, JsonReading& reading) {
    if (part.is_array()) {
        for (std::size_t i = 0; i < part.size(); ++i)
            refuse_late_keys(part[i], fmt::format("{}[{}]", path, i), reading);
        return;
    }
    if (!part.is_object()) return;
    for (const auto& [key, value] : part.items()) {
        const std::string here = path.empty() ? key : path + "." + key;
        if (value.is_array() && !value.empty())
            if (const std::optional<double> last = time_of_key(value.back(), key); last && *last > 1)
                reading.problems.push_back(fmt::format(
                    "{}: goes on until {:.6g}, but a static scene ends at 1, its whole load", here, *last));
        refuse_late_keys(value, here, reading);
    }
}

}  // namespace

SceneTime read_static_time(JsonObject& from) {
    SceneTime time;
    JsonObject of = from.object("static");
    StaticConfig statics;
    time.frames = of.integer("increments", 10, {1, 1e4, "between 1 and 10000"});
    statics.tolerance = of.number("tolerance", statics.tolerance, {1e-10, 0.1, "between 1e-10 and 0.1"});
    of.finish();
    for (const char* key : {"dt", "frames", "steps_per_frame"})
        if (from.has(key))
            from.problem(key, "must not be beside \"static\", whose increments are the frames");
    from.finish();
    time.dt = 1.0 / time.frames;
    time.steps_per_frame = 1;
    time.statics = statics;
    return time;
}

void refuse_motion(const nlohmann::json& scene, JsonReading& reading) {
    constexpr const char *at_rest = "bodies have no velocities", *undamped = "nothing is damped";
    for_entries(scene, "bodies", [&](const nlohmann::json& body, const std::string& path) {
        refuse(body, path, {{"velocity", at_rest}, {"angular_velocity", at_rest}}, reading);
        if (body.contains("material"))
            refuse(body["material"], path + ".material",
                   {{"rayleigh_mass", undamped}, {"rayleigh_stiffness", undamped}}, reading);
    });
    for_entries(scene, "joints", [&](const nlohmann::json& joint, const std::string& path) {
        refuse(joint, path, {{"strength", "joints do not break"}}, reading);
        for (const char* kind : {"hinge", "slider", "spring", "rope"})
            if (joint.contains(kind))
                refuse(joint[kind], fmt::format("{}.{}", path, kind), {{"damping", undamped}}, reading);
    });
    refuse_late_keys(scene, "", reading);
    for_entries(scene, "tendons", [&](const nlohmann::json& tendon, const std::string& path) {
        refuse(tendon, path, {{"winch", "balances know tendons with a \"force\" alone"}}, reading);
    });
    if (scene.contains("solver"))
        refuse(scene["solver"], "solver",
               {{"integrator", "there are no steps in time"},
                {"tangent", "increments choose it"},
                {"newton_tolerance", "\"time.static.tolerance\" is its tolerance"}},
               reading);
}

}  // namespace nbd
