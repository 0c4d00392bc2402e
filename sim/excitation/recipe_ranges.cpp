#include "sim/excitation/recipe_ranges.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <utility>

#include "collision/base/file_text.hpp"
#include "sim/json/json_object.hpp"

namespace nbd {
namespace {

constexpr double largest = 1e6;
constexpr NumberRange positive{1e-6, largest, "from 1e-6 to 1e6"};
constexpr NumberRange not_negative{0, largest, "from 0 to 1e6"};
constexpr NumberRange any_number{-largest, largest, "from -1e6 to 1e6"};
constexpr NumberRange share{0, 1, "from 0 to 1"};
constexpr NumberRange held_share{0, 0.45, "from 0 to 0.45"};

/// Calls visit for every number and range of a recipe file, with its key and what is allowed, in the order in
/// which they are written; visit.section(key, fields) for every object, with a function that does the same
/// for what is in it. r: RecipeRanges, constant or not.
template <class Ranges, class Visit>
void visit_fields(Ranges& r, Visit& visit) {
    visit("strength", r.strength, {1e-6, 1000, "> 0 and at most 1000"});
    visit("contact_share", r.contact_share, share);
    visit.section("kinds", [&](Visit& kinds) {
        for (std::size_t k = 0; k < r.kinds.size(); ++k)
            kinds.section(recipe_kind_names[k], [&](Visit& kind) {
                kind("weight", r.kinds[k].weight, not_negative);
                kind("gradient", r.kinds[k].gradient, not_negative);
                kind("forces", r.kinds[k].forces, {0, 100, "from 0 to 100"});
            });
    });
    visit("warm_up", r.warm_up, not_negative);
    visit.section("force", [&](Visit& force) {
        force("strain", r.force.strain, not_negative);
        force("radius", r.force.radius, positive);
        force("duration", r.force.duration, positive);
        force("balanced", r.force.balanced, share);
    });
    visit.section("floor", [&](Visit& floor) {
        floor("gap", r.floor.gap, not_negative);
        floor("sag", r.floor.sag, not_negative);
        floor("fall_speed", r.floor.fall_speed, not_negative);
        floor("under_thrown", r.floor.under_thrown, share);
    });
    visit.section("hands", [&](Visit& hands) {
        hands("share", r.hands.share, held_share);
        hands("twist", r.hands.twist, any_number);
        hands("bend", r.hands.bend, any_number);
        hands("stretch", r.hands.stretch, any_number);
        hands("shear", r.hands.shear, any_number);
        hands("start", r.hands.start, not_negative);
        hands("duration", r.hands.duration, positive);
        hands("release", r.hands.release, not_negative);
    });
    visit.section("thrown", [&](Visit& thrown) {
        thrown("speed", r.thrown.speed, not_negative);
        thrown("aside", r.thrown.aside, not_negative);
    });
    visit.section("fold", [&](Visit& fold) {
        fold("share", r.fold.share, held_share);
        fold("angle", r.fold.angle, {0, 1.5707, "from 0 to 1.5707"});
        fold("duration", r.fold.duration, positive);
    });
    visit.section("squash", [&](Visit& squash) {
        squash("share", r.squash.share, {0, 0.95, "from 0 to 0.95"});
        squash("duration", r.squash.duration, positive);
    });
    visit.section("curl", [&](Visit& curl) {
        curl("tips", r.curl.tips, {1, 32, "from 1 to 32"});
        curl("radius", r.curl.radius, positive);
        curl("close", r.curl.close, share);
        curl("duration", r.curl.duration, positive);
    });
}

/// Reads fields from an object; those that are missing keep their values.
struct FieldReader {
    JsonObject from;

    void operator()(const char* key, double& value, const NumberRange& allowed) {
        value = from.number(key, value, allowed);
    }
    void operator()(const char* key, std::optional<double>& value, const NumberRange& allowed) {
        value = from.optional_number(key, allowed);
    }
    void operator()(const char* key, Range& range, const NumberRange& allowed) {
        section(key, [&](FieldReader& ends) {
            ends("from", range.from, allowed);
            ends("to", range.to, allowed);
        });
        if (range.from > range.to)
            throw std::invalid_argument(fmt::format("{}: goes from {} to {}, but must not decrease",
                                                    from.path(key), range.from, range.to));
    }
    template <class Fields>
    void section(const char* key, const Fields& fields) {
        FieldReader inner{from.object(key)};
        fields(inner);
        inner.from.finish();
    }
};

/// Writes fields to an object.
struct FieldWriter {
    nlohmann::ordered_json to{};

    void operator()(const char* key, double value, const NumberRange&) { to[key] = value; }
    void operator()(const char* key, const std::optional<double>& value, const NumberRange&) {
        if (value) to[key] = *value;
    }
    void operator()(const char* key, const Range& range, const NumberRange&) {
        to[key] = {{"from", range.from}, {"to", range.to}};
    }
    template <class Fields>
    void section(const char* key, const Fields& fields) {
        FieldWriter inner;
        fields(inner);
        to[key] = std::move(inner.to);
    }
};

}  // namespace

RecipeRanges parse_recipe_ranges(std::string_view text) {
    const nlohmann::json value = parse_json(text);
    RecipeRanges ranges;
    FieldReader top{JsonObject(value, "recipe")};
    top.from.text("$schema", "");
    visit_fields(ranges, top);
    top.from.finish();
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

std::string to_json(const RecipeRanges& ranges) {
    FieldWriter text;
    visit_fields(ranges, text);
    return text.to.dump();
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
