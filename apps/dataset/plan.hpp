#pragma once

#include <memory>
#include <string>

#include "apps/dataset/shard_folder.hpp"
#include "apps/extras/extras_request.hpp"
#include "meshing/body/body.hpp"
#include "sim/excitation/recipe.hpp"

namespace nbd {

class SceneTrajectories;

/// Everything that determines a dataset's content, except the body.
struct DatasetPlan {
    int trajectories = 40, per_shard = 16;
    int attempts = 3;  // maximum per trajectory; each one after a failure halves the time step
    double held_out_share = 0.2;
    std::string hold_out{};  // the rule of a second split, see HoldOutRule; empty: none
    ExtrasRequest extras{};
    ExcitationConfig excitation;
    /// Where trajectories are drawn from a scene, which then has frames, times and forces; else null.
    std::shared_ptr<const SceneTrajectories> scene{};
};

/// JSON text of the plan, including the body's hash and material and the program's version.
std::string plan_json(const DatasetPlan& plan, const Body& body);

/// Throws std::invalid_argument where the body's trajectories cannot be drawn, see RecipeBook: what can be
/// said before anything is written.
void check_trajectories(const DatasetPlan& plan, const Body& body);

/// SHA-256 of the plan; identifies the files of one dataset.
std::string plan_key(const std::string& plan);

/// The first difference between the plans, as in "frames 50, not 60"; "" if there is none. Throws
/// std::invalid_argument if a text is not JSON.
std::string plan_difference(const std::string& there, const std::string& wanted);

/// Starts a dataset, or prepares to continue it: creates its folder and writes the plan there. plan: from
/// plan_json(). Throws std::runtime_error, naming the file and what differs, rather than continue a dataset
/// with other options or replace another file.
void begin_dataset(const ShardFolder& folder, const std::string& plan);

}  // namespace nbd
