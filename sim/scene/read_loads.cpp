#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "sim/scene/read_parts.hpp"

namespace nbd {
namespace {

constexpr std::pair<const char*, LoadKind> load_kinds[]{
    {"force", LoadKind::force},       {"torque", LoadKind::torque}, {"acceleration", LoadKind::acceleration},
    {"pressure", LoadKind::pressure}, {"gas", LoadKind::gas},       {"wind", LoadKind::wind}};

/// Reads a vector, or keyframes of it.
void read_keyed_vector(JsonObject& from, const char* name, Eigen::Vector3d& usual,
                       Keyed<Eigen::Vector3d>& keyed) {
    if (!from.holds_objects(name)) {
        usual = from.vector(name, usual);
        return;
    }
    for (JsonObject& key : from.objects(name)) {
        if (!key.need("time") || !key.need("value")) continue;
        const double time = key.optional_number("time", finite_number).value_or(0);
        const Eigen::Vector3d value = key.vector("value", Eigen::Vector3d::Zero());
        key.finish();
        if (!keyed.empty() && !(time > keyed.times.back())) {
            key.problem("time", fmt::format("is {:.6g}, but must be later than {:.6g} s, of the key before",
                                            time, keyed.times.back()));
            continue;
        }
        keyed.times.push_back(time);
        keyed.values.push_back(value);
    }
    if (!keyed.empty()) usual = keyed.values.front();
}

AirFlow read_wind(JsonObject from) {
    AirFlow air;
    from.need("velocity");
    read_keyed_vector(from, "velocity", air.velocity, air.keys);
    air.density = from.number("density", air.density, not_negative);
    air.normal = from.number("normal", air.normal, not_negative);
    air.tangential = from.number("tangential", air.tangential, not_negative);
    from.finish();
    return air;
}

CavityGas read_gas(JsonObject from) {
    CavityGas gas;
    gas.ambient = from.number("ambient", gas.ambient, not_negative);
    gas.pressure = from.optional_number("pressure", positive_number).value_or(gas.ambient);
    gas.exponent = from.number("exponent", gas.exponent, {1, 10, "between 1 and 10"});
    from.finish();
    return gas;
}

/// Where the load acts, and whether it can.
void read_place(JsonObject& from, LoadKind kind, SceneLoad& load) {
    if (from.has("region")) load.region = read_region(from.object("region"));
    const bool is_gas = kind == LoadKind::gas;
    if (is_gas && load.region) from.problem("region", "is not for a gas, which is in a \"cavity\"");
    const std::optional<double> cavity = from.optional_number("cavity", {0, 1e6, "between 0 and 1000000"});
    if (is_gas && !from.need("cavity")) return;
    if (!cavity) return;
    load.cavity = static_cast<int>(*cavity);
    if (*load.cavity != *cavity)
        from.problem("cavity", fmt::format("is {}, but must be a whole number", *cavity));
    if (load.region) from.problem("cavity", "must not be beside \"region\"");
    if (!is_gas && kind != LoadKind::pressure) from.problem("cavity", "is for a pressure or a gas");
}

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
    SceneLoad load{.key = key_of(from), .region = {}, .cavity = {}, .load = {}};
    const std::string given = from.need_one({"force", "torque", "acceleration", "pressure", "gas", "wind"});
    for (const auto& [key, kind] : load_kinds) {
        if (given != key) continue;
        load.load.kind = kind;
        if (kind == LoadKind::gas)
            load.load.gas = read_gas(from.object(key));
        else if (kind == LoadKind::wind)
            load.load.air = read_wind(from.object(key));
        else if (kind == LoadKind::pressure)
            load.load.pressure = from.optional_number(key, finite_number).value_or(0);
        else
            load.load.value = from.vector(key, load.load.value);
    }
    read_place(from, load.load.kind, load);
    load.load.factor = read_keyed(from, "factor");
    if (given == "gas" &&
        std::ranges::any_of(load.load.factor.values, [](double amount) { return amount < 0; }))
        from.problem("factor", "of a gas is how much of it there is, and must not be negative");
    if (given == "wind" && from.has("factor"))
        from.problem("factor", "is not for a wind, whose \"velocity\" takes keyframes");
    from.finish();
    return load;
}

SceneLoad read_muscle(JsonObject& from) {
    SceneLoad muscle{.key = key_of(from), .region = {}, .load = {.kind = LoadKind::muscle}};
    if (from.has("region")) muscle.region = read_region(from.object("region"));
    const std::string kind = from.need_one({"direction", "along"});
    if (kind == "direction")
        muscle.along = {Eigen::Vector3d::Zero(), read_direction(from, "direction", Eigen::Vector3d::UnitX())};
    if (kind == "along") {
        const std::vector<std::vector<double>> rows = from.table("along");
        for (const std::vector<double>& row : rows)
            if (row.size() == 3) muscle.along.emplace_back(row[0], row[1], row[2]);
        bool is_line = rows.size() >= 2 && muscle.along.size() == rows.size();
        for (std::size_t k = 1; k < muscle.along.size(); ++k)
            is_line = is_line && muscle.along[k] != muscle.along[k - 1];
        if (!is_line)
            from.problem("along",
                         "must be two points or more, each of three numbers, each apart from the next");
        if (!is_line) muscle.along.clear();
    }
    if (from.need("stress"))
        muscle.load.tension = from.optional_number("stress", positive_number).value_or(0);
    muscle.load.factor = read_keyed(from, "factor");
    if (!muscle.load.factor.empty() && std::ranges::min(muscle.load.factor.values) < 0)
        from.problem("factor", "must not be below 0: a muscle only pulls");
    from.finish();
    return muscle;
}

void read_gravity(JsonObject& from, SceneSpec& spec) {
    read_keyed_vector(from, "gravity", spec.gravity, spec.gravity_keys);
}

}  // namespace nbd
