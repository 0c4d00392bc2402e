#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/obstacles/obstacle.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// Two things that overlap or touch before the first step.
struct StartFault {
    bool overlaps = false;  // by more than 0.1 % of the body's size; false: they touch
    std::string text;       // "bodies[1]: overlaps bodies[0] at the start: 60 pairs of faces cross"
};

/// Finds what overlaps or touches, by exact bounds in single precision around a common origin.
class StartCheck {
 public:
    StartCheck();
    ~StartCheck();

    /// label: for messages. surface: at the start, metres; not empty.
    void add_body(std::string label, TriMesh surface);

    /// Pairs of bodies that cross, touch, or lie in each other.
    std::vector<StartFault> between_bodies();

    /// Bodies that are in the obstacle at time 0, touch it, or enclose it.
    std::vector<StartFault> with_obstacle(const std::string& label, const Obstacle& obstacle);

 private:
    class Surface;
    std::optional<StartFault> check(Surface& body, const std::string& label, const Obstacle& obstacle,
                                    Surface* solid);

    std::vector<std::unique_ptr<Surface>> bodies_;
    Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
    PairQuery query_;
};

/// What overlaps or touches in the world as it is. labels: of its bodies.
std::vector<StartFault> start_faults(const World& world, const std::vector<std::string>& labels);

/// What to do about them, as the end of a line.
inline constexpr const char* way_to_part =
    "; \"resolve_start\": true moves bodies apart before the first step";
/// Likewise about those that only touch.
inline constexpr const char* way_of_touching =
    "; unless it is held, a body is moved by as little before the first step";

/// One line about the first faults and the number of others, and what to do; empty if there are none.
/// resolved: whether bodies were already moved apart.
std::string start_warning(const std::vector<StartFault>& faults, bool resolved);

}  // namespace nbd
