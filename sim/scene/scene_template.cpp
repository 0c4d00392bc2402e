#include "sim/scene/scene_template.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <span>
#include <stdexcept>
#include <utility>

#include "collision/base/counter_random.hpp"
#include "collision/base/file_text.hpp"
#include "collision/base/shortened.hpp"
#include "sim/json/nearest_name.hpp"

namespace nbd {
namespace {

using Json = nlohmann::json;

Json json_of(const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); }

/// Draws a value of a law.
struct ValueDraw {
    CounterRandom random;

    Json operator()(const UniformLaw& law) {
        Eigen::Vector3d value;
        for (int i = 0; i < (law.is_vector ? 3 : 1); ++i)
            value[i] = law.is_log
                           ? std::clamp(std::exp(random.uniform(std::log(law.low[i]), std::log(law.high[i]))),
                                        law.low[i], law.high[i])
                           : random.uniform(law.low[i], law.high[i]);
        return law.is_vector ? json_of(value) : Json(value.x());
    }
    Json operator()(const IntegerLaw& law) {
        const double count = static_cast<double>(law.high - law.low) + 1;
        return law.low + static_cast<long long>(random.unit() * count);
    }
    Json operator()(const ChoiceLaw& law) {
        return law.values.empty() ? Json() : law.values[random.index(static_cast<int>(law.values.size()))];
    }
    Json operator()(const DirectionLaw& law) {
        const double z = random.uniform(std::cos(law.degrees * std::numbers::pi / 180), 1),
                     angle = random.uniform(0, 2 * std::numbers::pi), r = std::sqrt(std::max(0.0, 1 - z * z));
        const auto turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), law.about);
        return json_of((turn * Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z)).normalized());
    }
    Json operator()(const RotationLaw&) {
        const Eigen::AngleAxisd turn(random.orientation());
        return {{"axis", json_of(turn.axis())}, {"degrees", turn.angle() * 180 / std::numbers::pi}};
    }
};

/// Ends of a range, and all choices.
struct ExtremeValues {
    std::vector<Json> operator()(const UniformLaw& law) const {
        if (law.is_vector) return {json_of(law.low), json_of(law.high)};
        return {law.low.x(), law.high.x()};
    }
    std::vector<Json> operator()(const IntegerLaw& law) const { return {law.low, law.high}; }
    std::vector<Json> operator()(const ChoiceLaw& law) const { return law.values; }
    std::vector<Json> operator()(const DirectionLaw&) const { return {}; }
    std::vector<Json> operator()(const RotationLaw&) const { return {}; }
};

/// FNV-1a, so that a variable's values do not depend on the others.
std::uint64_t bits_of(std::string_view name) {
    std::uint64_t bits = 0xcbf29ce484222325u;
    for (const unsigned char c : name) bits = (bits ^ c) * 0x100000001b3u;
    return bits;
}

/// Puts values in the place of the variables of a scene.
class ValueFiller {
 public:
    ValueFiller(const SceneValues& values, std::span<const SceneVariable> variables, JsonReading& reading)
        : values_(values), reading_(reading) {
        for (const auto& [name, value] : values.items()) names_.push_back(name);
        for (const SceneVariable& variable : variables) copies_[variable.name] = variable.copies;
    }

    /// once: whether each body is there once, whatever its `count`.
    void fill_scene(Json& scene, bool once = false) {
        if (!scene.is_object()) return fill(scene, "");
        for (const auto& [key, entry] : scene.items())
            if (key == "bodies" && entry.is_array())
                fill_bodies(entry, once);
            else
                fill(entry, key);
    }
    /// The places in the template's `bodies` of those that fill_scene() has left.
    const std::vector<int>& entries() const { return entries_; }
    const std::set<std::string>& used() const { return used_; }

 private:
    void fill_bodies(Json& bodies, bool once) {
        Json all = Json::array();
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            const std::string path = fmt::format("bodies[{}]", i);
            const bool is_counted = bodies[i].is_object() && bodies[i].contains("count");
            const int count = is_counted ? count_of(bodies[i]["count"], path) : 1;
            if (is_counted) bodies[i].erase("count");
            for (int k = 0; k < (once ? 1 : count); ++k) {
                copy_ = is_counted ? k : -1;
                all.push_back(bodies[i]);
                fill(all.back(), path);
                entries_.push_back(static_cast<int>(i));
            }
            copy_ = -1;
        }
        bodies = std::move(all);
    }

    int count_of(Json count, const std::string& body) {
        fill(count, body + ".count");
        if (count.is_number_integer() && count >= 0 && count <= most_copies) return count.get<int>();
        reading_.problems.push_back(
            fmt::format("{}.count: is {}, but must be a whole number between 0 and {}", body,
                        shortened(count.dump(), 60), most_copies));
        return 1;
    }

    void fill(Json& value, const std::string& path) {
        if (value.is_object() && value.contains("var")) {
            value = value_of(JsonObject(value, path, &reading_));
        } else if (value.is_object()) {
            for (const auto& [key, entry] : value.items()) fill(entry, path.empty() ? key : path + "." + key);
        } else if (value.is_array()) {
            for (std::size_t i = 0; i < value.size(); ++i) fill(value[i], fmt::format("{}[{}]", path, i));
        }
    }

    /// The value of a variable in this copy; null where it has none.
    const Json* find_value(const std::string& name, const JsonObject& from) {
        const auto refuse = [&](const std::string& what) {
            from.problem("var", what);
            return nullptr;
        };
        const auto copies = copies_.find(name);
        const bool is_number = name == copy_variable,
                   has_copies = copies != copies_.end() && copies->second > 0;
        if ((is_number || has_copies) && copy_ < 0)
            return refuse(
                fmt::format("\"{}\" differs from copy to copy; allowed: in a body with \"count\"", name));
        if (is_number) return &(number_ = copy_);
        const auto found = values_.find(name);
        if (found == values_.end())
            return refuse(fmt::format("is {}, which is no variable{}", shortened(Json(name).dump(), 60),
                                      nearest_hint(name, names_, "; the nearest is \"{}\"")));
        if (!has_copies) return &*found;
        if (copy_ >= copies->second)
            return refuse(fmt::format("\"{}\" has {} copies, but the body has more", name, copies->second));
        const auto own = found->is_object() ? found->find(std::to_string(copy_)) : found->end();
        if (own == found->end()) return refuse(fmt::format("\"{}\" has no value for copy {}", name, copy_));
        return &*own;
    }

    Json value_of(JsonObject from) {
        const std::string name = from.text("var", "");
        const Json* found = find_value(name, from);
        const bool is_number = found && found->is_number(),
                   is_vector = found && found->is_array() && found->size() == 3 &&
                               std::ranges::all_of(*found, [](const Json&c) { return c.is_number(); });
        used_.insert(name);
        const bool is_moved = from.has("times") || from.has("plus");
        if (is_moved && found && !is_number && !is_vector)
            from.problem(
                "",
                fmt::format("\"times\" and \"plus\" are for numbers and vectors of three, but \"{}\" is {}",
                            name, shortened(found->dump(), 60)));
        Json result = found ? *found : Json(0);
        if (is_number && is_moved) result = moved_number(from, *found);
        if (is_vector && is_moved) result = moved_vector(from, *found);
        from.finish();
        return result;
    }

    static double factor(JsonObject& from) {
        return from.number("times", 1, {-1e30, 1e30, "between -1e30 and 1e30"});
    }

    static Json moved_number(JsonObject& from, const Json& value) {
        const double result = value.get<double>() * factor(from) +
                              from.number("plus", 0, {-1e30, 1e30, "between -1e30 and 1e30"});
        constexpr double exact = 9e15;
        if (value.is_number_integer() && std::nearbyint(result) == result && std::abs(result) < exact)
            return static_cast<long long>(result);
        return result;
    }

    static Json moved_vector(JsonObject& from, const Json& value) {
        const Eigen::Vector3d v(value[0].get<double>(), value[1].get<double>(), value[2].get<double>());
        return json_of(factor(from) * v + from.vector("plus", Eigen::Vector3d::Zero()));
    }

    const SceneValues& values_;
    JsonReading& reading_;
    std::vector<std::string> names_;
    std::map<std::string, int> copies_;  // by name; 0: it has one value
    std::set<std::string> used_;
    std::vector<int> entries_;
    int copy_ = -1;  // of the body that is filled; -1: it has no count
    Json number_;    // of the copy
};

/// A value for messages, with four digits.
std::string shown_briefly(const Json& value) {
    if (value.is_number_float()) return fmt::format("{:.4g}", value.get<double>());
    if (!value.is_structured()) return shortened(value.dump(), 60);
    std::string text;
    for (const auto& [key, member] : value.items())
        text += (text.empty() ? "" : ", ") + (value.is_object() ? key + " " : "") + shown_briefly(member);
    return value.is_object() ? text : "[" + text + "]";
}

Json template_json(std::string_view text) { return parse_json(without_comments(text)); }

}  // namespace

SceneTemplate::SceneTemplate(std::string_view text, std::filesystem::path base,
                             std::vector<std::string>& problems)
    : text_(text), base_(std::move(base)), scene_(template_json(text)) {
    JsonReading reading;
    JsonObject from(scene_, "", &reading);
    if (from.need("variables") && scene_["variables"].is_array() && scene_["variables"].empty())
        from.problem("variables", "must hold at least one variable");
    variables_ = read_variables(from);
    if (scene_.is_object()) scene_.erase("variables");
    if (reading.problems.empty()) {
        const SceneValues values = draw(0, 0);
        Json sample = scene_;
        ValueFiller filler(values, variables_, reading);
        filler.fill_scene(sample, true);
        for (const SceneVariable& variable : variables_)
            if (!filler.used().contains(variable.name))
                reading.problems.push_back(
                    fmt::format("{}: \"{}\" is not used; allowed: {{\"var\": \"{}\"}} somewhere in the scene",
                                variable.key, variable.name, variable.name));
    }
    problems.insert(problems.end(), reading.problems.begin(), reading.problems.end());
}

SceneValues SceneTemplate::draw(std::uint64_t seed, int trajectory, int again) const {
    const std::uint64_t stream =
        static_cast<std::uint64_t>(trajectory) + (static_cast<std::uint64_t>(again) << 32);
    SceneValues values = SceneValues::object();
    for (const SceneVariable& variable : variables_) {
        const auto value_of = [&](const std::string& name) {
            return std::visit(ValueDraw{CounterRandom(mix_bits(seed) ^ bits_of(name), stream)}, variable.law);
        };
        if (variable.copies == 0) values[variable.name] = value_of(variable.name);
        for (int k = 0; k < variable.copies; ++k)
            values[variable.name][std::to_string(k)] = value_of(fmt::format("{}[{}]", variable.name, k));
    }
    return values;
}

std::vector<SceneValues> SceneTemplate::extremes(std::uint64_t seed) const {
    const SceneValues drawn = draw(seed, 0);
    std::vector<SceneValues> all;
    for (const SceneVariable& variable : variables_)
        for (const Json& value : std::visit(ExtremeValues(), variable.law)) {
            all.push_back(drawn);
            if (variable.copies == 0) all.back()[variable.name] = value;
            for (int k = 0; k < variable.copies; ++k) all.back()[variable.name][std::to_string(k)] = value;
        }
    return all;
}

bool SceneTemplate::has_counts() const {
    const auto bodies = scene_.find("bodies");
    return bodies != scene_.end() && std::ranges::any_of(*bodies, [](const Json& body) {
               return body.is_object() && body.contains("count");
           });
}

std::vector<int> SceneTemplate::entries_of(const SceneValues& values) const {
    JsonReading reading;
    Json scene = scene_;
    ValueFiller filler(values, variables_, reading);
    filler.fill_scene(scene);
    return filler.entries();
}

std::string SceneTemplate::text_with(const SceneValues& values) const {
    JsonReading reading;
    Json scene = scene_;
    ValueFiller(values, variables_, reading).fill_scene(scene);
    if (!reading.problems.empty()) throw std::invalid_argument(reading.problems.front());
    return scene.dump(2);
}

bool is_template(std::string_view text) {
    const Json json = template_json(text);
    return json.is_object() && json.contains("variables");
}

SceneTemplate load_template(const std::filesystem::path& path) {
    const std::string text = file_text(path);
    try {
        std::vector<std::string> problems;
        SceneTemplate scene(text, path.parent_path(), problems);
        if (!problems.empty()) throw std::invalid_argument(problems.front());
        return scene;
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format("{}: {}", path.string(), error.what()));
    }
}

void set_values(const SceneTemplate& scene, const std::vector<std::string>& settings, SceneValues& values) {
    std::vector<std::string> names;
    for (const SceneVariable& variable : scene.variables()) names.push_back(variable.name);
    std::set<std::string> set;
    for (const std::string& setting : settings) {
        const std::size_t sign = setting.find('=');
        if (sign == setting.npos || sign == 0)
            throw std::invalid_argument(fmt::format("\"{}\" is not NAME=VALUE", setting));
        const std::string name = setting.substr(0, sign), text = setting.substr(sign + 1);
        if (std::ranges::find(names, name) == names.end())
            throw std::invalid_argument(
                fmt::format("\"{}\" is no variable of the scene; allowed: {}", name, fmt::join(names, ", ")));
        if (!set.insert(name).second) throw std::invalid_argument(fmt::format("\"{}\" is set twice", name));
        const Json value = Json::parse(text, nullptr, false);
        values[name] = value.is_discarded() ? Json(text) : value;
    }
}

std::string values_text(const SceneValues& values) {
    std::string text;
    for (const auto& [name, value] : values.items())
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, shown_briefly(value));
    return text;
}

bool has_variable(const Json& value) {
    if (value.is_object() && value.contains("var")) return true;
    return value.is_structured() && std::ranges::any_of(value, has_variable);
}

}  // namespace nbd
