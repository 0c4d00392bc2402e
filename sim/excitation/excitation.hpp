#pragma once

#include <functional>
#include <memory>
#include <string>

#include "collision/tree/collision_tree.hpp"
#include "sim/excitation/recipe.hpp"
#include "sim/fem/elastic_body.hpp"
#include "sim/multilevel/rest_hierarchy.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// Result of a training trajectory.
struct TrajectoryResult {
    int frames = 0;         // number of frames passed to on_frame
    std::string failure{};  // empty: complete; otherwise one line, and the frames end at the last good one
    std::string start_fault{};  // empty, or one line: what overlaps at the start
    std::string drawn_again{};  // empty, or one line: why its values are not those that were drawn first
    std::string moved{};        // empty, or one line: what was moved apart at the start
    bool can_improve = true;    // whether shorter steps may help where it failed
};

/// One frame of a trajectory.
struct ExcitedFrame {
    double time;         // seconds since the start of the trajectory
    const Nodes& x;      // tet nodes of the body [N, 3], metres
    int contacts;        // pressing contacts of all bodies in the last step
    int troubled;        // steps since the last frame, or the start, whose trouble spoils the pose
    const World& world;  // of an excitation: body 1 is the copy that is thrown at body 0, if there is one
    int body = 0;        // whose trajectory it is
};
using OnFrame = std::function<void(const ExcitedFrame&)>;

/// Training trajectories of one body. All members are const: trajectories may run in any order and in several
/// threads at once, and give the same bits.
///
/// A body whose surface has many times the vertices of its tetrahedra's boundary makes contact by that
/// boundary, which costs far less and keeps the surface inside apart, too, unless tetrahedra are inside out.
/// Its tetrahedra are then full.
class Excitation {
 public:
    /// Throws std::invalid_argument for an unusable body or number.
    Excitation(Body body, const ExcitationConfig& config);

    /// Simulates trajectory `index`, >= 0. steps_per_frame: 0 for the config's value; use more to repeat a
    /// failed trajectory. Exceptions of on_frame pass through; simulation failures are returned in the
    /// result.
    TrajectoryResult run(int index, const OnFrame& on_frame, int steps_per_frame = 0) const;

    /// The world in which trajectory `index` starts.
    World start(int index) const;

    /// Recipe of a trajectory as JSON text.
    std::string recipe(int index) const { return recipe_json(recipes_.draw(index)); }

 private:
    std::shared_ptr<const Body> body_;
    ExcitationConfig config_;
    std::shared_ptr<const ElasticBody> elastic_;
    RecipeBook recipes_;
    std::shared_ptr<const Body> contact_;  // with the surface that makes contact
    std::shared_ptr<const CollisionTree> tree_;
    std::shared_ptr<RestHierarchies> hierarchies_;
};

}  // namespace nbd
