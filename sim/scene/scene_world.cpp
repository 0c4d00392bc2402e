#include <fmt/format.h>

#include <stdexcept>

#include "sim/scene/scene_parts.hpp"

namespace nbd {

World build_world(const SceneSpec& spec, std::span<const LoadedBody> bodies) {
    if (bodies.size() != spec.bodies.size())
        throw std::invalid_argument(
            fmt::format("scene: it has {} bodies, but {} were loaded", spec.bodies.size(), bodies.size()));
    World world({.gravity = spec.gravity, .contact = spec.contact, .step = spec.step});
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        try {
            world.add_body(make_world_body(spec.bodies[b], bodies[b]));
        } catch (const std::invalid_argument& error) {
            throw std::invalid_argument(
                fmt::format("bodies[{}] ({}): {}", b, spec.bodies[b].name, error.what()));
        }
    }
    for (std::size_t o = 0; o < spec.obstacles.size(); ++o) {
        try {
            world.add_obstacle(make_obstacle(spec.obstacles[o]));
        } catch (const std::invalid_argument& error) {
            throw std::invalid_argument(fmt::format("obstacles[{}]: {}", o, error.what()));
        }
    }
    return world;
}

}  // namespace nbd
