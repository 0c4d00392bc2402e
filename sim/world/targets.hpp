#pragma once

#include <Eigen/Core>
#include <map>
#include <utility>

#include "sim/barrier/barrier.hpp"
#include "sim/obstacles/motion.hpp"
#include "sim/world/world_state.hpp"

namespace nbd {

/// What is told from step to step: where obstacles, grips, motors, tensions and loads go in the next one. See
/// World for what each call does and throws.
class Targets {
 public:
    /// Return whether it was known until now that the obstacle or grip stands for ever: what is held may
    /// touch such an obstacle.
    bool move_obstacle(WorldState& world, int obstacle, Keyframe place);
    bool move_grip(WorldState& world, int body, int grip, Keyframe place);
    void set_joint(WorldState& world, int joint, double value);
    void set_load(WorldState& world, int body, int load, double factor);
    void set_wind(WorldState& world, int body, int load, const Eigen::Vector3d& velocity);

    /// Lets all of it go to its targets in a step of length dt. A step that is begun anew does the same
    /// again.
    void go(WorldState& world, Barrier& barrier, double dt);
    /// At the end of the step that has done so.
    void clear() { *this = {}; }
    /// Before any step has, or where one was interrupted: all goes as if nothing had been told. Returns
    /// whether obstacles or grips have other motions for that.
    bool forget(WorldState& world);

 private:
    std::map<int, Keyframe> obstacles_{};
    std::map<std::pair<int, int>, Keyframe> grips_{};  // by body and number
    // What was told before.
    std::map<int, Motion> obstacles_before_{};
    std::map<std::pair<int, int>, Motion> grips_before_{};
    std::map<int, Keyed<double>> joints_before_{};
    std::map<std::pair<int, int>, Keyed<double>> factors_before_{};
    std::map<std::pair<int, int>, Keyed<Eigen::Vector3d>> winds_before_{};
    std::map<int, double> joints_{};
    std::map<std::pair<int, int>, double> factors_{};         // of loads, likewise
    std::map<std::pair<int, int>, Eigen::Vector3d> winds_{};  // likewise
};

}  // namespace nbd
