#include "sim/excitation/recipe_ranges.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>

#include "collision/base/file_text.hpp"
#include "sim/json/json_object.hpp"

namespace nbd {
namespace {

constexpr double largest = 1e6;
constexpr NumberRange positive{1e-6, largest, "from 1e-6 to 1e6"};
constexpr NumberRange not_negative{0, largest, "from 0 to 1e6"};
constexpr NumberRange any_number{-largest, largest, "from -1e6 to 1e6"};
constexpr NumberRange share{0, 1, "from 0 to 1"};

void read_range(JsonObject& from, const std::string& key, Range& range, const NumberRange& allowed) {
    if (!from.has(key)) return;
    JsonObject entry = from.object(key);
    range.from = entry.number("from", range.from, allowed);
    range.to = entry.number("to", range.to, allowed);
    entry.finish();
    if (range.from > range.to)
        throw std::invalid_argument(fmt::format("{}: goes from {} to {}, but must not decrease",
                                                from.path(key), range.from, range.to));
}

void read_kinds(JsonObject from, std::array<KindRanges, recipe_kinds>& kinds) {
    for (std::size_t k = 0; k < kinds.size(); ++k) {
        JsonObject entry = from.object(recipe_kind_names[k]);
        kinds[k].weight = entry.number("weight", kinds[k].weight, not_negative);
        kinds[k].forces = entry.number("forces", kinds[k].forces, {0, 100, "from 0 to 100"});
        read_range(entry, "gradient", kinds[k].gradient, not_negative);
        entry.finish();
    }
    from.finish();
}

void read_force(JsonObject from, RecipeRanges::Force& force) {
    read_range(from, "strain", force.strain, not_negative);
    read_range(from, "radius", force.radius, positive);
    read_range(from, "duration", force.duration, positive);
    force.balanced = from.number("balanced", force.balanced, share);
    from.finish();
}

void read_floor(JsonObject from, RecipeRanges::Floor& floor) {
    read_range(from, "gap", floor.gap, not_negative);
    read_range(from, "sag", floor.sag, not_negative);
    read_range(from, "fall_speed", floor.fall_speed, not_negative);
    floor.under_thrown = from.number("under_thrown", floor.under_thrown, share);
    from.finish();
}

void read_hands(JsonObject from, RecipeRanges::Hands& hands) {
    read_range(from, "share", hands.share, {0, 0.45, "from 0 to 0.45"});
    read_range(from, "twist", hands.twist, any_number);
    read_range(from, "bend", hands.bend, any_number);
    read_range(from, "stretch", hands.stretch, any_number);
    read_range(from, "shear", hands.shear, any_number);
    read_range(from, "start", hands.start, not_negative);
    read_range(from, "duration", hands.duration, positive);
    read_range(from, "release", hands.release, not_negative);
    from.finish();
}

void read_thrown(JsonObject from, RecipeRanges::Thrown& thrown) {
    read_range(from, "speed", thrown.speed, not_negative);
    read_range(from, "aside", thrown.aside, not_negative);
    from.finish();
}

void read_fold(JsonObject from, RecipeRanges::Fold& fold) {
    read_range(from, "share", fold.share, {0, 0.45, "from 0 to 0.45"});
    read_range(from, "angle", fold.angle, {0, 1.5707, "from 0 to 1.5707"});
    read_range(from, "duration", fold.duration, positive);
    from.finish();
}

void read_squash(JsonObject from, RecipeRanges::Squash& squash) {
    read_range(from, "share", squash.share, {0, 0.95, "from 0 to 0.95"});
    read_range(from, "duration", squash.duration, positive);
    from.finish();
}

void read_curl(JsonObject from, RecipeRanges::Curl& curl) {
    read_range(from, "tips", curl.tips, {1, 32, "from 1 to 32"});
    read_range(from, "radius", curl.radius, positive);
    read_range(from, "close", curl.close, share);
    read_range(from, "duration", curl.duration, positive);
    from.finish();
}

nlohmann::ordered_json json(const Range& range) { return {{"from", range.from}, {"to", range.to}}; }

}  // namespace

RecipeRanges parse_recipe_ranges(std::string_view text) {
    const nlohmann::json value = parse_json(text);
    RecipeRanges ranges;
    JsonObject top(value, "recipe");
    top.text("$schema", "");
    ranges.strength = top.number("strength", ranges.strength, {1e-6, 1000, "> 0 and at most 1000"});
    if (top.has("contact_share")) ranges.contact_share = top.number("contact_share", 0, share);
    read_kinds(top.object("kinds"), ranges.kinds);
    read_range(top, "warm_up", ranges.warm_up, not_negative);
    read_force(top.object("force"), ranges.force);
    read_floor(top.object("floor"), ranges.floor);
    read_hands(top.object("hands"), ranges.hands);
    read_thrown(top.object("thrown"), ranges.thrown);
    read_fold(top.object("fold"), ranges.fold);
    read_squash(top.object("squash"), ranges.squash);
    read_curl(top.object("curl"), ranges.curl);
    top.finish();
    recipe_mix(ranges);
    return ranges;
}

RecipeRanges load_recipe_ranges(const std::filesystem::path& path) {
    const std::string text = file_text(path);
    try {
        return parse_recipe_ranges(text);
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(fmt::format("{}: {}", path.string(), error.what()));
    }
}

std::string to_json(const RecipeRanges& r) {
    nlohmann::ordered_json text;
    text["strength"] = r.strength;
    if (r.contact_share) text["contact_share"] = *r.contact_share;
    for (std::size_t k = 0; k < r.kinds.size(); ++k)
        text["kinds"][recipe_kind_names[k]] = {{"weight", r.kinds[k].weight},
                                               {"gradient", json(r.kinds[k].gradient)},
                                               {"forces", r.kinds[k].forces}};
    text["warm_up"] = json(r.warm_up);
    text["force"] = {{"strain", json(r.force.strain)},
                     {"radius", json(r.force.radius)},
                     {"duration", json(r.force.duration)},
                     {"balanced", r.force.balanced}};
    text["floor"] = {{"gap", json(r.floor.gap)},
                     {"sag", json(r.floor.sag)},
                     {"fall_speed", json(r.floor.fall_speed)},
                     {"under_thrown", r.floor.under_thrown}};
    text["hands"] = {{"share", json(r.hands.share)},       {"twist", json(r.hands.twist)},
                     {"bend", json(r.hands.bend)},         {"stretch", json(r.hands.stretch)},
                     {"shear", json(r.hands.shear)},       {"start", json(r.hands.start)},
                     {"duration", json(r.hands.duration)}, {"release", json(r.hands.release)}};
    text["thrown"] = {{"speed", json(r.thrown.speed)}, {"aside", json(r.thrown.aside)}};
    text["fold"] = {
        {"share", json(r.fold.share)}, {"angle", json(r.fold.angle)}, {"duration", json(r.fold.duration)}};
    text["squash"] = {{"share", json(r.squash.share)}, {"duration", json(r.squash.duration)}};
    text["curl"] = {{"tips", json(r.curl.tips)},
                    {"radius", json(r.curl.radius)},
                    {"close", json(r.curl.close)},
                    {"duration", json(r.curl.duration)}};
    return text.dump();
}

std::array<double, recipe_kinds> recipe_mix(const RecipeRanges& ranges) {
    const auto touches = [](std::size_t kind) {
        return kind == static_cast<std::size_t>(RecipeKind::drop) ||
               kind == static_cast<std::size_t>(RecipeKind::thrown) ||
               kind == static_cast<std::size_t>(RecipeKind::squash);
    };
    std::array<double, recipe_kinds> mix{};
    double with = 0, without = 0;
    for (std::size_t k = 0; k < mix.size(); ++k) {
        mix[k] = ranges.kinds[k].weight;
        (touches(k) ? with : without) += mix[k];
    }
    if (with + without <= 0)
        throw std::invalid_argument("recipe.kinds: all weights are 0, but one must be > 0");
    const double share = ranges.contact_share.value_or(with / (with + without));
    if ((share > 0 && with <= 0) || (share < 1 && without <= 0))
        throw std::invalid_argument(fmt::format("recipe.contact_share: is {}, but the weights of {} are 0",
                                                share,
                                                with <= 0 ? "drop, thrown and squash" : "all other kinds"));
    for (std::size_t k = 0; k < mix.size(); ++k)
        mix[k] *= touches(k) ? (with > 0 ? share / with : 0) : (without > 0 ? (1 - share) / without : 0);
    return mix;
}

}  // namespace nbd
