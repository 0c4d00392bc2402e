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
    bool is_held = false;   // neither of the two can be moved
    std::string text;       // "bodies[1]: overlaps bodies[0] at the start: 60 pairs of faces cross"
    std::string way;        // what to do about it, the end of a line
};

/// Finds what overlaps or touches, by exact bounds in single precision around a common origin.
class StartCheck {
 public:
    /// apart: how far held bodies should be apart, for messages, metres. rules: which surfaces meet, by the
    /// order in which bodies are added, and the numbers of obstacles.
    StartCheck(double apart, PairRules rules);
    ~StartCheck();

    /// label: for messages. surface: at the start, metres; not empty. is_held: whether it cannot be moved.
    void add_body(std::string label, TriMesh surface, bool is_held);

    /// Pairs of bodies that cross, touch, or lie in each other.
    std::vector<StartFault> between_bodies();

    /// Bodies that are in the obstacle at time 0, touch it, or enclose it.
    std::vector<StartFault> with_obstacle(int number, const std::string& label, const Obstacle& obstacle);

 private:
    class Surface;
    StartFault fault(bool overlaps, const Surface& body, const std::string& what,
                     const Surface* other = nullptr) const;
    std::optional<StartFault> check(Surface& body, const std::string& label, const Obstacle& obstacle,
                                    Surface* solid);

    double apart_;
    PairRules rules_;
    std::vector<std::unique_ptr<Surface>> bodies_;
    Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
    PairQuery query_;
};

/// What overlaps or touches in the world as it is, without what is held and only touches: it may, see
/// Barrier. labels: of its bodies. obstacles: of its obstacles; empty: "obstacles[0]" ...
std::vector<StartFault> start_faults(const World& world, const std::vector<std::string>& labels,
                                     const std::vector<std::string>& obstacles = {});

/// Whether a world may start, by the rule of all programs that step it.
struct StartVerdict {
    std::string refusal{};             // why its steps refuse the start; empty: they do not
    std::vector<StartFault> faults{};  // of start_faults(); without a refusal, what may make motions wrong
};
StartVerdict judge_start(World& world, const std::vector<std::string>& labels,
                         const std::vector<std::string>& obstacles = {});

/// One line about the first faults and the number of others, and what to do; empty if there are none.
/// resolved: whether bodies were already moved apart.
std::string start_warning(const std::vector<StartFault>& faults, bool resolved);

}  // namespace nbd
