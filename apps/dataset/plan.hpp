#pragma once

#include <string>

#include "meshing/body/body.hpp"
#include "sim/excitation/recipe.hpp"

namespace nbd {

/// All that decides what a dataset holds, beside the body.
struct DatasetPlan {
    int trajectories = 40, per_shard = 16;
    int attempts = 3;  // at a trajectory that fails, each with steps half as long
    double held_out_share = 0.2;
    ExcitationConfig excitation;
};

/// As JSON text, the body's hash and material and the program's version included.
std::string plan_json(const DatasetPlan& plan, const Body& body);

/// What tells files of one dataset from those of another: the SHA-256 of its plan.
std::string plan_key(const std::string& plan);

/// "frames 50, not 60": the first thing in which plan `there` differs from plan `wanted`; "" where they
/// agree. Throws std::invalid_argument where a text is not JSON.
std::string plan_difference(const std::string& there, const std::string& wanted);

}  // namespace nbd
