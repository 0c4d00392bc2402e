#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <set>
#include <utility>

#include "sim/scene/read_parts.hpp"

namespace nbd {
namespace {

constexpr double per_degree = std::numbers::pi / 180;

/// unit: of the freedom's values in the scene.
JointFreedom read_freedom(JsonObject& from, double unit, const NumberRange& limits) {
    JointFreedom freedom;
    freedom.motor = read_keyed(from, "motor");
    for (double& value : freedom.motor.values) value *= unit;
    const auto limit = [&](const char* key) -> std::optional<double> {
        const std::optional<double> value = from.optional_number(key, limits);
        return value ? std::optional(unit * *value) : std::nullopt;
    };
    freedom.least = limit("least");
    freedom.most = limit("most");
    freedom.stiffness = from.number("stiffness", 0, not_negative);
    freedom.rest = unit * from.number("rest", 0, finite_number);
    freedom.damping = from.number("damping", 0, not_negative);
    if (from.has("rest") && !(freedom.stiffness > 0))
        from.problem("rest", "is of a spring; needs \"stiffness\"");
    return freedom;
}

Eigen::Vector3d read_axis(JsonObject& from) { return read_direction(from, "axis", Eigen::Vector3d::UnitZ()); }

Eigen::Vector3d read_point(JsonObject& from, const char* key) {
    from.need(key);
    return from.vector(key, Eigen::Vector3d::Zero());
}

void read_kind(JsonObject& from, SceneJoint& result) {
    const std::string kind = from.need_one({"ball", "hinge", "slider", "weld", "spring", "rope"});
    if (kind.empty()) return;
    JsonObject of = from.object(kind);
    if (kind == "ball") {
        result.joint.kind = BallJoint{.point = read_point(of, "point")};
    } else if (kind == "hinge") {
        HingeJoint hinge{.point = read_point(of, "point"), .axis = read_axis(of), .angle = {}};
        hinge.angle = read_freedom(of, per_degree, {-150, 150, "between -150 and 150"});
        result.joint.kind = std::move(hinge);
    } else if (kind == "slider") {
        SliderJoint slider{.point = read_point(of, "point"), .axis = read_axis(of), .way = {}};
        slider.way = read_freedom(of, 1, finite_number);
        result.joint.kind = std::move(slider);
    } else if (kind == "weld") {
        if (of.need("region")) result.region = read_region(of.object("region"));
        result.joint.kind = WeldJoint{};
    } else {
        const bool is_rope = kind == "rope";
        CordJoint cord{.from = read_point(of, "from"), .to = read_point(of, "to"), .length = {}};
        cord.pulls_only = is_rope;
        if (!is_rope) {
            of.need("stiffness");
            cord.stiffness = of.optional_number("stiffness", positive_number).value_or(1);
        } else {
            cord.stiffness = of.number("stiffness", 0, not_negative);
        }
        cord.damping = of.number("damping", 0, not_negative);
        cord.length = of.optional_number("length", positive_number);
        cord.winch = read_keyed(of, "winch");
        if (cord.length && !cord.winch.empty()) of.problem("winch", "must not be beside \"length\"");
        if (std::ranges::any_of(cord.winch.values, [](double value) { return !(value > 0); })) {
            of.problem("winch", "needs lengths above 0");
            cord.winch = {};
        }
        result.joint.kind = std::move(cord);
    }
    of.finish();
}

}  // namespace

void read_tendons(JsonObject& from, SceneSpec& spec) {
    struct Via {
        int body;  // -1: the world
        Eigen::Vector3d at;
    };
    const SceneNames names(spec);
    std::vector<SceneJoint>& joints = spec.joints;
    for (JsonObject& entry : from.objects("tendons")) {
        const std::string key = entry.path("");
        std::string name = entry.text("name", "");
        if (name.empty()) name = key;
        std::vector<Via> vias;
        for (JsonObject& via : entry.objects("through")) {
            const int body = via.has("body") ? names.body(via, "body", via.text("body", "")) : -1;
            vias.push_back({body, read_point(via, "at")});
            via.finish();
            if (vias.size() > 1 && vias[vias.size() - 2].at == vias.back().at)
                via.problem("at", "is where the point before it is");
        }
        const std::string kind = entry.need_one({"force", "winch"});
        const double force = entry.number("force", 0, not_negative);
        Tendon tendon{.parts = {}, .winch = read_keyed(entry, "winch")};
        tendon.stiffness = entry.number("stiffness", 0, not_negative);
        if (std::ranges::any_of(tendon.winch.values, [](double value) { return !(value > 0); })) {
            entry.problem("winch", "needs lengths above 0");
            tendon.winch = {};
        }
        for (const char* key : {"factor", "stiffness"})
            if (entry.has(key) && !kind.empty() && (kind == "winch") != (key == std::string("stiffness")))
                entry.problem(key, kind == "winch" ? "is of a force, and this tendon has a length"
                                                   : "is for a tendon with a \"winch\"");
        Keyed<double> tension = read_keyed(entry, "factor");
        if (!tension.empty() && std::ranges::min(tension.values) < 0)
            entry.problem("factor", "must not be below 0: a tendon only pulls");
        if (tension.empty())  // as other loads without keyframes
            tension = spec.time.statics ? Keyed<double>{{0.0, 1.0}, {0.0, 1.0}} : Keyed<double>{{0.0}, {1.0}};
        for (double& value : tension.values) value *= force;
        if (vias.size() < 2) entry.problem("through", "must be two points or more");
        if (std::ranges::all_of(vias, [](const Via& via) { return via.body < 0; }) && vias.size() > 1)
            entry.problem("through", "must have a point of a body");
        entry.finish();
        const bool is_winch = !tendon.winch.empty();
        std::vector<SceneJoint> parts;
        for (std::size_t k = 1; k < vias.size(); ++k) {
            const bool is_turned = vias[k - 1].body < 0;  // the world is second
            const Via &a = vias[is_turned ? k : k - 1], &b = vias[is_turned ? k - 1 : k];
            if (a.body < 0) {
                tendon.fixed += (a.at - b.at).norm();
                continue;
            }
            SceneJoint& part = parts.emplace_back();
            part.key = key;
            part.joint.a = a.body;
            part.joint.b = b.body;
            if (is_winch) part.tendon = static_cast<int>(spec.tendons.size());
            CordJoint cord{.from = a.at, .to = b.at};
            cord.tension = tension;
            part.joint.kind = std::move(cord);
        }
        for (std::size_t k = 0; k < parts.size(); ++k) {
            parts[k].joint.name = parts.size() == 1 ? name : fmt::format("{} {}", name, k + 1);
            if (std::ranges::any_of(
                    joints, [&](const SceneJoint& other) { return other.joint.name == parts[k].joint.name; }))
                entry.problem("name", fmt::format("\"{}\" is the name of another joint or tendon",
                                                  parts[k].joint.name));
            joints.push_back(std::move(parts[k]));
        }
        if (is_winch && !parts.empty()) spec.tendons.push_back(std::move(tendon));
    }
}

std::vector<SceneJoint> read_joints(JsonObject& from, const SceneSpec& spec) {
    const SceneNames names(spec);
    std::vector<SceneJoint> joints;
    std::set<std::string> taken;
    for (JsonObject& entry : from.objects("joints")) {
        SceneJoint& result = joints.emplace_back();
        result.key = entry.path("");
        result.joint.name = entry.text("name", "");
        if (result.joint.name.empty()) result.joint.name = result.key;
        if (!taken.insert(result.joint.name).second)
            entry.problem("name", fmt::format("\"{}\" is the name of another joint", result.joint.name));
        const std::string who = entry.need_one({"bodies", "body"});
        if (who == "bodies") {
            if (const std::vector<std::string> two = entry.texts("bodies", 2); !two.empty()) {
                result.joint.a = names.body(entry, "bodies", two[0]);
                result.joint.b = names.body(entry, "bodies", two[1]);
                if (two[0] == two[1]) entry.problem("bodies", "joins a body to itself");
            }
        } else if (who == "body") {
            result.joint.a = names.body(entry, "body", entry.text("body", ""));
        }
        read_kind(entry, result);
        result.joint.width = entry.number("width", 0, not_negative);
        result.joint.strength =
            entry.optional_number("strength", positive_number).value_or(result.joint.strength);
        result.joint.bodies_meet = entry.flag("meet", false);
        if (entry.has("width") && !(entry.has("hinge") || entry.has("slider")))
            entry.problem("width", "applies to hinges and sliders only");
        if (entry.has("meet") && (entry.has("spring") || entry.has("rope") || !entry.has("bodies")))
            entry.problem("meet", "applies to two bodies that are held together; others touch in any case");
        entry.finish();
    }
    return joints;
}

}  // namespace nbd
