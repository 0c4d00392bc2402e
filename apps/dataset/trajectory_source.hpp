#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <string>

#include "apps/dataset/plan.hpp"
#include "sim/excitation/excitation.hpp"

namespace nbd {

/// A trajectory of a dataset at its start.
struct Trajectory {
    std::string recipe;  // what happens in it, JSON text to be stored with it
    int steps_per_frame = 1;
    /// Simulates it. Exceptions of on_frame pass through; failures are in the result.
    std::function<TrajectoryResult(const OnFrame& on_frame)> run;
};

/// Where a dataset's trajectories come from. Any thread may start any of them, in any order, with the same
/// bits.
class TrajectorySource {
 public:
    virtual ~TrajectorySource() = default;

    /// Starts trajectory `index`, >= 0, with steps so many times shorter than planned.
    virtual Trajectory start(int index, int refinement) const = 0;

    /// What positions are counted from, metres.
    virtual Eigen::Vector3d origin() const = 0;

    /// Number of nodes of all bodies.
    virtual Eigen::Index nodes() const = 0;
};

/// The trajectories of a plan: of its scene, or else of its recipes.
std::shared_ptr<const TrajectorySource> trajectory_source(const DatasetPlan& plan, const Body& body);

}  // namespace nbd
