#include <fmt/format.h>

#include "sim/scene/read_parts.hpp"

namespace nbd {
namespace {

constexpr std::pair<const char*, LoadKind> load_kinds[]{{"force", LoadKind::force},
                                                        {"torque", LoadKind::torque},
                                                        {"acceleration", LoadKind::acceleration},
                                                        {"pressure", LoadKind::pressure}};

}  // namespace

Keyed<double> read_keyed(JsonObject& from, const char* key) {
    Keyed<double> keyed;
    for (const auto& [time, value] : from.number_pairs(key)) {
        if (!keyed.empty() && !(time > keyed.times.back())) {
            from.problem(key, fmt::format("its times must increase, but {:.6g} s follows {:.6g} s", time,
                                          keyed.times.back()));
            return {};
        }
        keyed.times.push_back(time);
        keyed.values.push_back(value);
    }
    return keyed;
}

SceneLoad read_load(JsonObject& from) {
    SceneLoad load{.key = key_of(from), .region = {}, .load = {}};
    if (from.has("region")) load.region = read_region(from.object("region"));
    const std::string given = from.need_one({"force", "torque", "acceleration", "pressure"});
    for (const auto& [key, kind] : load_kinds) {
        if (given != key) continue;
        load.load.kind = kind;
        if (kind == LoadKind::pressure)
            load.load.pressure = from.optional_number(key, finite_number).value_or(0);
        else
            load.load.value = from.vector(key, load.load.value);
    }
    load.load.factor = read_keyed(from, "factor");
    from.finish();
    return load;
}

void read_gravity(JsonObject& from, SceneSpec& spec) {
    if (!from.holds_objects("gravity")) {
        spec.gravity = from.vector("gravity", spec.gravity);
        return;
    }
    for (JsonObject& key : from.objects("gravity")) {
        if (!key.need("time") || !key.need("value")) continue;
        const double time = key.optional_number("time", finite_number).value_or(0);
        const Eigen::Vector3d value = key.vector("value", Eigen::Vector3d::Zero());
        key.finish();
        if (!spec.gravity_keys.empty() && !(time > spec.gravity_keys.times.back())) {
            key.problem("time", fmt::format("is {:.6g}, but must be later than {:.6g} s, of the key before",
                                            time, spec.gravity_keys.times.back()));
            continue;
        }
        spec.gravity_keys.times.push_back(time);
        spec.gravity_keys.values.push_back(value);
    }
    if (!spec.gravity_keys.empty()) spec.gravity = spec.gravity_keys.values.front();
}

}  // namespace nbd
