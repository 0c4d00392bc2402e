#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

#include "apps/dataset/plan.hpp"
#include "sim/excitation/excitation.hpp"

namespace nbd {

/// A trajectory of a dataset at its start.
class Trajectory {
 public:
    virtual ~Trajectory() = default;

    /// What happens in it, JSON text to be stored with it, and its steps per frame.
    virtual std::string recipe() const = 0;
    virtual int steps_per_frame() const = 0;

    /// Simulates it. Exceptions of on_frame pass through; failures are in the result.
    virtual TrajectoryResult run(const OnFrame& on_frame) = 0;
};

/// Where a dataset's trajectories come from. Any thread may start any of them, in any order, with the same
/// bits.
class TrajectorySource {
 public:
    virtual ~TrajectorySource() = default;

    /// Starts trajectory `index`, >= 0, with steps so many times shorter than planned.
    virtual std::unique_ptr<Trajectory> start(int index, int refinement) const = 0;

    /// What positions are counted from, metres.
    virtual Eigen::Vector3d origin() const = 0;

    /// Number of nodes of all bodies.
    virtual Eigen::Index nodes() const = 0;
};

/// The trajectories of a plan: of its scene, or else of its recipes.
std::shared_ptr<const TrajectorySource> trajectory_source(const DatasetPlan& plan, const Body& body);

}  // namespace nbd
