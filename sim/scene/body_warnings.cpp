#include "sim/scene/body_warnings.hpp"

#include <fmt/format.h>

#include <map>
#include <stdexcept>

#include "meshing/body/body_hints.hpp"
#include "sim/scene/scene_parts.hpp"

namespace nbd {

std::vector<std::string> body_labels(const SceneSpec& spec) {
    std::vector<std::string> labels;
    for (std::size_t b = 0; b < spec.bodies.size(); ++b)
        labels.push_back(fmt::format("bodies[{}] ({})", b, spec.bodies[b].name));
    return labels;
}

std::vector<std::string> scene_body_warnings(const SceneSpec& spec,
                                             std::span<const LoadedBody* const> bodies) {
    std::vector<std::string> texts;                      // in the order in which they are found
    std::map<std::string, std::vector<std::size_t>> of;  // the bodies of a text
    std::map<const Body*, std::string> thin;             // bodies that share data are measured once
    const auto add = [&](std::size_t b, const std::string& text) {
        if (text.empty()) return;
        if (of[text].empty()) texts.push_back(text);
        of[text].push_back(b);
    };
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (!bodies[b]) continue;
        const Body& body = *bodies[b]->body;
        add(b, size_hint(body, spec.bodies[b].placement.scale));
        if (!thin.contains(&body)) thin[&body] = thin_hint(body.tets);
        add(b, thin[&body]);
        try {
            const BodyMaterials materials = scene_materials(spec.bodies[b], *bodies[b]);
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
    return lines;
}

}  // namespace nbd
