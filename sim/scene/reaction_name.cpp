#include "sim/scene/reaction_name.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace nbd {

std::string unique_name(const SceneSpec& spec, int body) {
    const std::string& name = spec.bodies.at(body).name;
    return std::ranges::count(spec.bodies, name, &SceneBody::name) == 1 ? name
                                                                        : fmt::format("bodies[{}]", body);
}

const char* name(ReactionBy by) noexcept {
    switch (by) {
        case ReactionBy::grip:
            return "grip";
        case ReactionBy::driven:
            return "driven";
        case ReactionBy::obstacle:
            return "obstacle";
        case ReactionBy::body:
            return "body";
        case ReactionBy::joint:
            return "joint";
        case ReactionBy::cavity:
            return "cavity";
        case ReactionBy::wind:
            return "wind";
    }
    return "";
}

std::string reaction_name(const SceneSpec& spec, const Reaction& reaction) {
    switch (reaction.by) {
        case ReactionBy::grip:
            return spec.bodies.at(reaction.body).grips.at(reaction.number).key;
        case ReactionBy::obstacle:
            return spec.obstacles.at(reaction.number).name;
        case ReactionBy::body:
            return unique_name(spec, reaction.number);
        case ReactionBy::joint:
            return spec.joints.at(reaction.number).joint.name;
        case ReactionBy::cavity:
            return fmt::format("cavity {}", reaction.number);
        case ReactionBy::wind:
            return spec.bodies.at(reaction.body).loads.at(reaction.number).key;
        case ReactionBy::driven:
            break;
    }
    return name(reaction.by);
}

}  // namespace nbd
