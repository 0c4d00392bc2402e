#include "sim/scene/scene_check.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

#include "sim/scene/body_warnings.hpp"
#include "sim/scene/build_world.hpp"
#include "sim/scene/local_scene.hpp"
#include "sim/world/start_check.hpp"

namespace nbd {
namespace {

class SceneCheck {
 public:
    SceneCheck(const SceneReading& reading, std::span<const LoadedBody> bodies)
        : reading_(reading), bodies_(bodies), spec_(local_scene(reading.spec, bodies)) {}

    SceneFindings run() {
        for (std::size_t b = 0; b < bodies_.size(); ++b)
            if (bodies_[b].body) check_body(b);
        findings_.warnings = scene_body_warnings(spec_, bodies_);
        if (!spec_.resolve_start) add(start_.between_bodies());
        for (std::size_t o = 0; o < spec_.obstacles.size(); ++o)
            if (reading_.obstacle_is_good[o]) check_obstacle(o);
        return std::move(findings_);
    }

 private:
    void check_body(std::size_t number) {
        const auto say = [&](const std::string& what) {
            findings_.problems.push_back(fmt::format("bodies[{}]: {}", number, what));
        };
        SceneBody spec = spec_.bodies[number];
        const std::vector<SceneGrip> grips = std::exchange(spec.grips, {});
        try {
            WorldBody body =
                make_world_body(spec, bodies_[number],
                                scene_elastic(spec, bodies_[number], scene_materials(spec, bodies_[number])));
            check_grips(number, grips, body.state.x);
            start_.add_body(fmt::format("bodies[{}]", number), {embedded(body.W, body.state.x), body.F});
            World({}).add_body(std::move(body));
        } catch (const std::exception& error) {
            say(error.what());
        }
    }

    void check_grips(std::size_t number, const std::vector<SceneGrip>& grips, const Nodes& x) {
        std::vector<const SceneGrip*> holder(x.rows(), nullptr);
        for (const SceneGrip& grip : grips) {
            const std::vector<int> nodes = nodes_in(grip.region, x);
            const SceneGrip* other = nullptr;
            for (const int node : nodes) {
                const SceneGrip*& held_by = holder[node];
                if (held_by && !other) other = held_by;
                held_by = &grip;
            }
            const auto say = [&](const std::string& what) {
                findings_.problems.push_back(fmt::format("bodies[{}].{}: {}", number, grip.key, what));
            };
            if (nodes.empty()) say("the region holds no node of the body");
            if (other) say("contains nodes that " + other->key + " also holds");
        }
    }

    void add(const std::vector<StartFault>& faults) {
        for (const StartFault& fault : faults)
            (fault.overlaps ? findings_.problems : findings_.warnings).push_back(fault.text + way_to_part);
    }

    void check_obstacle(std::size_t number) {
        try {
            const Obstacle obstacle = make_obstacle(spec_.obstacles[number]);
            nbd::check_obstacle(obstacle);
            if (!spec_.resolve_start)
                add(start_.with_obstacle(fmt::format("obstacles[{}]", number), obstacle));
        } catch (const std::exception& error) {
            findings_.problems.push_back(fmt::format("obstacles[{}]: {}", number, error.what()));
        }
    }

    const SceneReading& reading_;
    std::span<const LoadedBody> bodies_;
    SceneSpec spec_;
    StartCheck start_;
    SceneFindings findings_;
};

}  // namespace

SceneFindings check_scene(const SceneReading& reading, std::span<const LoadedBody> bodies) {
    return SceneCheck(reading, bodies).run();
}

}  // namespace nbd
