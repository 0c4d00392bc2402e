#include "sim/scene/body_warnings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>
#include <variant>

#include "meshing/body/body_hints.hpp"
#include "meshing/surface/counted.hpp"
#include "meshing/surface/mesh.hpp"
#include "sim/contact/rest_gaps.hpp"
#include "sim/contact/self_contact.hpp"
#include "sim/scene/build_world.hpp"

namespace nbd {

std::vector<std::string> body_labels(const SceneSpec& spec) {
    std::vector<std::string> labels;
    for (std::size_t b = 0; b < spec.bodies.size(); ++b)
        labels.push_back(fmt::format("bodies[{}] ({})", b, spec.bodies[b].name));
    return labels;
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
            add(b, locking_hint(materials.material, materials.regions));
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

std::vector<std::string> narrow_gap_warnings(const SceneSpec& spec, const World& world) {
    std::vector<std::string> lines;
    if (!spec.contact.self_contact || spec.contact.intersection_free) return lines;
    std::map<const ContactShape*, RestGaps> known;  // bodies that share data are measured once
    const std::vector<std::string> labels = body_labels(spec);
    for (int b = 0; b < world.body_count(); ++b) {
        const ContactShape& shape = *world.surface(b).shape();
        const auto [entry, is_new] = known.try_emplace(&shape);
        if (!is_new) continue;
        const double distance = 2 * self_thickness(shape, world.thickness());
        entry->second = rest_gaps({embedded(shape.W, world.elastic(b).rest().X), shape.F}, distance);
        if (entry->second.pairs > 0)
            lines.push_back(fmt::format(
                "{}: {} face each other at rest nearer than {:.2g} m, twice the contact "
                "distance, the nearest {:.2g} m apart; by default they make no contact and may "
                "pass each other; \"intersection_free\": true prevents that",
                labels[b], counted(entry->second.pairs, "pair of its faces", "pairs of its faces"), distance,
                entry->second.least));
    }
    return lines;
}

}  // namespace nbd
