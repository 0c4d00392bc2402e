#pragma once

#include <functional>
#include <memory>
#include <string>

#include "collision/collision_tree.hpp"
#include "sim/elastic_body.hpp"
#include "sim/recipe.hpp"

namespace nbd {

/// How a training trajectory ended.
struct TrajectoryResult {
    int frames = 0;         // handed out
    std::string recipe{};   // JSON text
    std::string failure{};  // empty: complete; else one line, and the frames end at the last good one
};

/// Receives a frame: seconds since the trajectory began, and the tet nodes [N, 3], metres.
using OnFrame = std::function<void(double time, const Nodes& x)>;

/// Training trajectories of one body. Const throughout: trajectories may run in any order and on several
/// threads at once, and give the same bits.
class Excitation {
 public:
    /// Copies what it needs of the body. Throws std::invalid_argument on a body or number it cannot use.
    Excitation(Body body, const ExcitationConfig& config);

    /// Simulates trajectory `index`, >= 0. Exceptions of on_frame pass through; trouble of the simulation is
    /// reported in the result instead.
    TrajectoryResult run(int index, const OnFrame& on_frame) const;

    const ExcitationConfig& config() const noexcept { return config_; }
    double frame_interval() const;  // seconds, also where the config leaves it open

 private:
    Body body_;
    ExcitationConfig config_;
    std::shared_ptr<const ElasticBody> elastic_;
    std::shared_ptr<const CollisionTree> tree_;
};

}  // namespace nbd
