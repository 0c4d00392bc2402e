#pragma once

#include <functional>
#include <memory>
#include <string>

#include "collision/tree/collision_tree.hpp"
#include "sim/excitation/recipe.hpp"
#include "sim/fem/elastic_body.hpp"
#include "sim/solvers/rest_factor.hpp"

namespace nbd {

/// How a training trajectory ended.
struct TrajectoryResult {
    int frames = 0;         // handed out
    std::string recipe{};   // JSON text
    std::string failure{};  // empty: complete; else one line, and the frames end at the last good one
};

/// One frame of a trajectory.
struct ExcitedFrame {
    double time;     // seconds since the trajectory began
    const Nodes& x;  // tet nodes [N, 3], metres
    int contacts;    // that pressed during the last step, on whatever moves
};
using OnFrame = std::function<void(const ExcitedFrame&)>;

/// Training trajectories of one body. Const throughout: trajectories may run in any order and on several
/// threads at once, and give the same bits.
class Excitation {
 public:
    /// Copies what it needs of the body. Throws std::invalid_argument on a body or number it cannot use.
    Excitation(Body body, const ExcitationConfig& config);

    /// Simulates trajectory `index`, >= 0. steps_per_frame: 0 for the config's; more, for a second attempt at
    /// what failed. Exceptions of on_frame pass through; trouble of the simulation is reported in the result
    /// instead.
    TrajectoryResult run(int index, const OnFrame& on_frame, int steps_per_frame = 0) const;

    /// Recipe of a trajectory as JSON text, as its result has it.
    std::string recipe(int index) const { return recipe_json(recipes_.draw(index)); }

    const ExcitationConfig& config() const noexcept { return config_; }
    double frame_interval() const noexcept;  // seconds, also where the config leaves it open

 private:
    std::shared_ptr<const Body> body_;
    ExcitationConfig config_;
    std::shared_ptr<const ElasticBody> elastic_;
    RecipeBook recipes_;
    std::shared_ptr<const CollisionTree> tree_;
    std::shared_ptr<RestFactors> factors_;
};

}  // namespace nbd
