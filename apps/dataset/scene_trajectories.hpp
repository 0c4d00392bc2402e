#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/cli/load_body.hpp"
#include "apps/dataset/trajectory_source.hpp"
#include "sim/scene/scene_template.hpp"

namespace nbd {

/// What a dataset takes from a scene.
struct SceneDataset {
    std::string body{};  // name of the bodies whose poses are recorded; empty: all, if they are alike
    std::optional<int> frames{};  // instead of the scene's
    std::uint64_t seed = 1;
    /// How often values are drawn again at most, where the start intersects.
    static constexpr int redraws = 8;
};

/// Trajectories that are drawn from a scene with variables. Each records the poses of one body; of several
/// with the name, trajectory k records the k-th of those that it has, in turn.
class SceneTrajectories : public TrajectorySource {
 public:
    /// Reads the bodies that are recorded. Throws std::invalid_argument, one line, where values at the ends
    /// of their ranges make no scene, no body has the name, the bodies that have it are not alike, or what
    /// they are made of is drawn; and what reading throws.
    SceneTrajectories(SceneTemplate scene, const SceneDataset& config);

    Trajectory start(int index, int refinement) const override;
    Eigen::Vector3d origin() const override { return origin_; }
    Eigen::Index nodes() const override { return nodes_; }

    /// The body whose poses are recorded.
    const Body& body() const noexcept { return *body_; }
    /// Its file, for training: the scene's, or one in the folder of the dataset, which is written if it is
    /// not there.
    std::filesystem::path body_file(const std::filesystem::path& folder) const;

    /// Frames of a trajectory, and all files that trajectories may need.
    int frames() const noexcept { return frames_; }
    const std::vector<std::filesystem::path>& inputs() const noexcept { return inputs_; }
    std::vector<std::string> variables() const;

    /// Recipe of a trajectory as its values are drawn first.
    std::string recipe(int index) const;

    /// Adds what determines the trajectories to a dataset's plan.
    void add_to_plan(nlohmann::ordered_json& plan) const;

 private:
    class Started;
    void find_recorded(const SceneSpec& spec);
    void check_recorded(const SceneValues& values, const SceneSpec& spec) const;
    std::vector<int> named(const SceneSpec& spec) const;
    int recorded_in(const SceneSpec& spec, int index) const;
    SceneSpec scene_of(const SceneValues& values) const;
    std::vector<LoadedBody> load(SceneSpec& spec) const;
    std::string recipe_text(int body, const SceneValues& values, const std::vector<std::string>& refused,
                            const std::vector<std::string>& moved) const;

    SceneTemplate scene_;
    SceneDataset config_;
    std::vector<int> recorded_;  // bodies of trajectory 0
    int entry_ = 0;              // in the scene's `bodies`, of the first of these
    std::string name_;           // of the recorded bodies
    std::shared_ptr<const Body> body_;
    std::filesystem::path body_file_;  // empty: the scene makes the body
    Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
    Eigen::Index nodes_ = 0;
    int frames_ = 0;
    std::vector<std::filesystem::path> inputs_;
    mutable std::mutex loading_;
    mutable SceneFiles files_;  // what was loaded
    mutable int loaded_ = 0;    // scenes since files_ was emptied
};

}  // namespace nbd
