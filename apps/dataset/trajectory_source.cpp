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

    std::unique_ptr<Trajectory> start(int index, int refinement) const override {
        return std::make_unique<Started>(excitation_, index, refinement * steps_per_frame_);
    }
    Eigen::Vector3d origin() const override { return origin_; }
    Eigen::Index nodes() const override { return nodes_; }

 private:
    class Started : public Trajectory {
     public:
        Started(const Excitation& excitation, int index, int steps)
            : excitation_(excitation), index_(index), steps_(steps) {}
        std::string recipe() const override { return excitation_.recipe(index_); }
        int steps_per_frame() const override { return steps_; }
        TrajectoryResult run(const OnFrame& on_frame) override {
            return excitation_.run(index_, on_frame, steps_);
        }

     private:
        const Excitation& excitation_;
        int index_, steps_;
    };

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
