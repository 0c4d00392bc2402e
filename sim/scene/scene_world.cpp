#include <fmt/format.h>

#include <memory>
#include <stdexcept>
#include <vector>

#include "sim/scene/local_scene.hpp"
#include "sim/scene/scene_parts.hpp"

namespace nbd {
namespace {

/// Calls act(), and puts the body's place in the scene before the message of what it throws.
template <class Act>
void naming_body(const SceneSpec& spec, std::size_t b, const Act& act) {
    try {
        act();
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format("bodies[{}] ({}): {}", b, spec.bodies[b].name, error.what()));
    }
}

}  // namespace

void make_trees(const SceneSpec& spec, std::span<LoadedBody> bodies) {
    const std::vector<LoadedBody> loaded(bodies.begin(), bodies.end());
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        std::size_t same = 0;
        while (same < b && !(loaded[same].body == loaded[b].body && loaded[same].tree == loaded[b].tree &&
                             spec.bodies[same].bounds == spec.bodies[b].bounds))
            ++same;
        naming_body(spec, b, [&] {
            bodies[b].tree = same < b ? bodies[same].tree : scene_tree(spec.bodies[b], loaded[b]);
        });
    }
}

World build_world(const SceneSpec& given, std::span<const LoadedBody> bodies, std::vector<StartMove>* moves) {
    if (bodies.size() != given.bodies.size())
        throw std::invalid_argument(
            fmt::format("scene: it has {} bodies, but {} were loaded", given.bodies.size(), bodies.size()));
    const SceneSpec spec = local_scene(given, bodies);
    World world(
        {.gravity = spec.gravity, .contact = spec.contact, .step = spec.step, .origin = *spec.origin});
    std::vector<std::shared_ptr<const ElasticBody>> elastic(bodies.size());
    std::vector<BodyMaterials> materials(bodies.size());
    for (std::size_t b = 0; b < bodies.size(); ++b)
        naming_body(spec, b, [&] {
            materials[b] = scene_materials(spec.bodies[b], bodies[b]);
            for (std::size_t a = 0; a < b && !elastic[b]; ++a)
                if (bodies[a].body == bodies[b].body &&
                    spec.bodies[a].placement.scale == spec.bodies[b].placement.scale &&
                    materials[a] == materials[b])
                    elastic[b] = elastic[a];
            if (!elastic[b]) elastic[b] = scene_elastic(spec.bodies[b], bodies[b], materials[b]);
            world.add_body(make_world_body(spec.bodies[b], bodies[b], elastic[b]));
        });
    for (std::size_t o = 0; o < spec.obstacles.size(); ++o) {
        try {
            world.add_obstacle(make_obstacle(spec.obstacles[o]));
        } catch (const std::invalid_argument& error) {
            throw std::invalid_argument(fmt::format("obstacles[{}]: {}", o, error.what()));
        }
    }
    if (spec.resolve_start) {
        std::vector<StartMove> made = world.resolve_start();
        if (moves) *moves = std::move(made);
    }
    return world;
}

}  // namespace nbd
