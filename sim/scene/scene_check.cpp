#include "sim/scene/scene_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>
#include <variant>

#include "meshing/body/body_hints.hpp"
#include "meshing/surface/counted.hpp"
#include "meshing/surface/mesh.hpp"
#include "sim/scene/build_world.hpp"
#include "sim/world/start_check.hpp"

namespace nbd {

std::vector<std::string> body_labels(const SceneSpec& spec) {
    std::vector<std::string> labels;
    for (std::size_t b = 0; b < spec.bodies.size(); ++b)
        labels.push_back(fmt::format("bodies[{}] ({})", b, spec.bodies[b].name));
    return labels;
}

std::vector<StartMove> move_apart(const SceneSpec& spec, World& world) {
    return spec.resolve_start ? world.resolve_start() : world.part_touching();
}

std::string moved_text(const std::string& label, const StartMove& move) {
    return fmt::format(
        "{}: touched or overlapped something at the start and was moved by ({:.3g}, {:.3g}, {:.3g}) m", label,
        move.by.x(), move.by.y(), move.by.z());
}

namespace {

/// One line about the first sphere that the vertices of a body may not meet, and how many there are; empty if
/// there is none. Contact reaches out by the thickness, but pressed faces stretch, so it does not count.
std::string small_ball_warning(const SceneSpec& spec, std::span<const LoadedBody> bodies) {
    double gap = 0;
    std::size_t coarsest = 0;
    std::map<const Body*, double> gaps;  // bodies that share data are measured once
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (!bodies[b].body) continue;
        const Body& body = *bodies[b].body;
        const auto [known, is_new] = gaps.try_emplace(&body, 0);
        if (is_new) known->second = vertex_gap(body.surface);
        const double placed = spec.bodies[b].placement.scale * known->second;
        if (placed > gap) coarsest = b;
        gap = std::max(gap, placed);
    }
    std::size_t count = 0, first = 0;
    double radius = 0;
    for (std::size_t o = 0; o < spec.obstacles.size(); ++o) {
        const BallShape* ball = std::get_if<BallShape>(&spec.obstacles[o].obstacle.shape);
        if (!ball || ball->radius >= gap) continue;
        if (count++ > 0) continue;
        first = o;
        radius = ball->radius;
    }
    if (count == 0) return "";
    return fmt::format(
        "obstacles[{}]{}: the sphere's radius is {:.3g} m, but the surface of {} has points {:.3g} m "
        "from the nearest vertex of their face; only vertices meet a sphere, so it may pass through faces; "
        "a mesh as obstacle, or a surface of smaller faces, prevents that",
        first, count > 1 ? fmt::format(" and {} more", count - 1) : "", radius, body_labels(spec)[coarsest],
        gap);
}

/// A line about the largest stress of muscles and pressures that may be too much for long steps; empty: none.
std::string load_hint(const SceneBody& spec, const BodyMaterials& materials) {
    constexpr double most = 0.1;  // of Young's modulus
    double young = materials.material.young, largest = 0;
    for (const MaterialRegion& region : materials.regions) young = std::min(young, region.material.young);
    std::string key;
    for (const SceneLoad& load : spec.loads) {
        double factor = load.load.factor.empty() ? 1 : 0;
        for (const double value : load.load.factor.values) factor = std::max(factor, std::abs(value));
        const double stress = factor * std::max(load.load.tension, std::abs(load.load.pressure));
        if (stress > largest) key = load.key;
        largest = std::max(largest, stress);
    }
    if (!(largest > most * young)) return "";
    return fmt::format(
        "{} has up to {:.3g} Pa, more than a tenth of Young's modulus, {:.3g} Pa: long steps may go wrong and take "
        "long; short ones, or `newton_iterations`, help",
        key, largest, young);
}

}  // namespace

std::vector<std::string> scene_body_warnings(const SceneSpec& spec, std::span<const LoadedBody> bodies) {
    std::vector<std::string> texts;                      // in the order in which they are found
    std::map<std::string, std::vector<std::size_t>> of;  // the bodies of a text
    std::map<const Body*, std::string> thin;             // bodies that share data are measured once
    const auto add = [&](std::size_t b, const std::string& text) {
        if (text.empty()) return;
        if (of[text].empty()) texts.push_back(text);
        of[text].push_back(b);
    };
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (!bodies[b].body) continue;
        const Body& body = *bodies[b].body;
        add(b, size_hint(body, spec.bodies[b].placement.scale));
        if (!thin.contains(&body)) thin[&body] = thin_hint(body.tets);
        add(b, thin[&body]);
        try {
            const BodyMaterials materials = scene_materials(spec.bodies[b], bodies[b]);
            add(b, locking_hint(body.tets, materials.material, materials.regions));
            if (!is_rigid(body.tets) && spec.step.newton_iterations == 1 && !spec.time.statics)
                add(b, load_hint(spec.bodies[b], materials));
        } catch (const std::invalid_argument&) {  // a problem of its own
        }
    }
    const std::vector<std::string> labels = body_labels(spec);
    std::vector<std::string> lines;
    for (const std::string& text : texts) {
        const std::vector<std::size_t>& all = of[text];
        std::string who = labels[all.front()];
        if (all.size() > 1) who += fmt::format(" and {} more", all.size() - 1);
        lines.push_back(fmt::format("{}: {}", who, text));
    }
    if (std::string line = small_ball_warning(spec, bodies); !line.empty()) lines.push_back(std::move(line));
    return lines;
}

std::vector<std::string> rest_warnings(const SceneSpec& spec, World& world) {
    std::map<int, std::vector<Intersection>> found;
    for (const Intersection& touching : world.touching_at_rest())
        found[touching.surface_a].push_back(touching);  // bodies are the first surfaces
    const std::vector<std::string> labels = body_labels(spec);
    std::vector<std::string> lines;
    for (const auto& [body, all] : found)
        lines.push_back(fmt::format(
            "{}: {} intersect at rest, the first are {} and {}; these and their neighbours do not press each "
            "other, and do not count as intersecting",
            labels[body], counted(all.size(), "pair of its faces", "pairs of its faces"), all.front().a,
            all.front().b));
    return lines;
}

namespace {

class SceneCheck {
 public:
    SceneCheck(const SceneReading& reading, std::span<const LoadedBody> bodies)
        : reading_(reading),
          bodies_(bodies),
          spec_(local_scene(reading.spec, bodies)),
          world_({.gravity = spec_.gravity, .gravity_keys = spec_.gravity_keys, .contact = spec_.contact}) {}

    SceneFindings run() {
        for (std::size_t b = 0; b < bodies_.size(); ++b)
            if (bodies_[b].body) check_body(b);
        findings_.warnings = scene_body_warnings(spec_, bodies_);
        for (std::size_t o = 0; o < spec_.obstacles.size(); ++o)
            if (reading_.obstacle_is_good[o]) check_obstacle(o);
        if (world_.body_count() > 0) check_start();
        return std::move(findings_);
    }

 private:
    void check_body(std::size_t number) {
        const std::string label = fmt::format("bodies[{}]", number);
        SceneBody spec = spec_.bodies[number];
        const std::vector<SceneGrip> grips = std::exchange(spec.grips, {});
        try {
            WorldBody body =
                make_world_body(spec, bodies_[number],
                                scene_elastic(spec, bodies_[number], scene_materials(spec, bodies_[number])));
            body.grips = checked_grips(number, grips, {*bodies_[number].body, body.state.x});
            check_loads(spec, body);
            world_.add_body(std::move(body));
            labels_.push_back(label);
            party_in_world_[number] = world_.body_count() - 1;
        } catch (const std::exception& error) {
            findings_.problems.push_back(fmt::format("{}: {}", label, error.what()));
        }
    }

    /// Without those that hold no node, and those that hold nodes of others at the same time.
    std::vector<Grip> checked_grips(std::size_t number, const std::vector<SceneGrip>& grips,
                                    const PlacedBody& placed) {
        std::vector<const SceneGrip*> kept;
        std::vector<Grip> result;
        const auto say = [&](const std::string& line) {
            findings_.problems.push_back(fmt::format("bodies[{}].{}", number, line));
        };
        for (const SceneGrip& grip : grips) {
            try {
                result.push_back(take_nodes(grip, placed));
            } catch (const std::invalid_argument& error) {
                say(error.what());
                continue;
            }
            kept.push_back(&grip);
            const auto odds = grips_at_odds(result);
            if (!odds) continue;
            say(at_odds_text(grip.key, kept[odds->first]->key, odds->from));
            result.pop_back();
            kept.pop_back();
        }
        return result;
    }

    void check_obstacle(std::size_t number) {
        const std::string label = fmt::format("obstacles[{}]", number);
        try {
            world_.add_obstacle(make_obstacle(spec_.obstacles[number]));
            obstacle_labels_.push_back(label);
            party_in_world_[party_of_obstacle(number)] = party_of_obstacle(std::ssize(obstacle_labels_) - 1);
        } catch (const std::exception& error) {
            findings_.problems.push_back(fmt::format("{}: {}", label, error.what()));
        }
    }

    /// Whether nothing is wrong with what the text has at a path.
    bool is_good(const std::string& key) const {
        return std::ranges::none_of(reading_.problems, [&](const std::string& problem) {
            return problem.starts_with(key + ".") || problem.starts_with(key + ":");
        });
    }

    void check_joint(const SceneJoint& spec) {
        const Joint& joint = spec.joint;
        if (!party_in_world_.contains(joint.a) || (joint.b >= 0 && !party_in_world_.contains(joint.b)))
            return;
        SceneJoint local = spec;
        local.joint.a = party_in_world_[joint.a];
        if (joint.b >= 0) local.joint.b = party_in_world_[joint.b];
        try {
            add_joint(local, world_, *bodies_[joint.a].body);
        } catch (const std::invalid_argument& error) {
            findings_.problems.push_back(error.what());
        }
    }

    /// As a run begins.
    void check_start() {
        for (const auto& [key, a, b, rule] : spec_.pairs)
            if (is_good(key) && party_in_world_.contains(a) && party_in_world_.contains(b))
                world_.set_pair(party_in_world_[a], party_in_world_[b], rule);
        for (const SceneJoint& joint : spec_.joints)
            if (is_good(joint.key)) check_joint(joint);
        try {
            for (const StartMove& move : move_apart(spec_, world_))
                findings_.notes.push_back(moved_text(labels_[move.body], move));
        } catch (const std::invalid_argument& error) {
            findings_.problems.push_back(error.what());
            findings_.start_problems = 1;
            return;
        }
        const std::size_t before = findings_.problems.size();
        const StartVerdict verdict = judge_start(world_, labels_, obstacle_labels_);
        std::vector<std::string>& lines = verdict.refusal.empty() ? findings_.warnings : findings_.problems;
        for (const StartFault& fault : verdict.faults)
            lines.push_back(spec_.resolve_start ? start_warning({fault}, true) : fault.text + fault.way);
        if (!verdict.refusal.empty() && verdict.faults.empty()) lines.push_back(verdict.refusal);
        findings_.start_problems = findings_.problems.size() - before;
    }

    const SceneReading& reading_;
    std::span<const LoadedBody> bodies_;
    SceneSpec spec_;
    World world_;  // of what is good
    std::vector<std::string> labels_, obstacle_labels_;
    std::map<int, int> party_in_world_;  // of the scene's bodies and obstacles that are good, see PairRules
    SceneFindings findings_;
};

}  // namespace

SceneFindings check_scene(const SceneReading& reading, std::span<const LoadedBody> bodies) {
    return SceneCheck(reading, bodies).run();
}

}  // namespace nbd
