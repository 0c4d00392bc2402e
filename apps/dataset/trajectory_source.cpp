#include "apps/dataset/trajectory_source.hpp"

#include "apps/dataset/scene_trajectories.hpp"

namespace nbd {
namespace {

/// Edges of contact are those of the body's own surface.
ExcitationConfig excitation_of(const DatasetPlan& plan) {
    ExcitationConfig config = plan.excitation;
    config.own_surface = plan.extras.contact_edges;
    return config;
}

/// Trajectories of recipes.
class RecipeTrajectories : public TrajectorySource {
 public:
    RecipeTrajectories(const DatasetPlan& plan, const Body& body)
        : excitation_(body, excitation_of(plan)),
          steps_per_frame_(plan.excitation.steps_per_frame),
          origin_(body.origin),
          nodes_(body.tets.X.rows()) {}

    Trajectory start(int index, int refinement) const override {
        const int steps = refinement * steps_per_frame_;
        return {excitation_.recipe(index), steps, [this, index, steps](const OnFrame& on_frame) {
                    return excitation_.run(index, on_frame, steps);
                }};
    }
    Eigen::Vector3d origin() const override { return origin_; }
    Eigen::Index nodes() const override { return nodes_; }

 private:
    Excitation excitation_;
    int steps_per_frame_;
    Eigen::Vector3d origin_;
    Eigen::Index nodes_;
};

}  // namespace

std::shared_ptr<const TrajectorySource> trajectory_source(const DatasetPlan& plan, const Body& body) {
    if (plan.scene) return plan.scene;
    return std::make_shared<const RecipeTrajectories>(plan, body);
}

}  // namespace nbd
