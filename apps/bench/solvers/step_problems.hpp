#pragma once

#include <memory>
#include <string>
#include <vector>

#include "meshing/body/body.hpp"
#include "sim/fem/step_system.hpp"

namespace nbd {

/// The linear system A v = b of one body in one step of a scene.
struct StepProblem {
    std::string scene;
    StepSystem system;  // the same equations, as our own solver reads them
    SparseMatrix A;     // symmetric, both triangles; its blocks are rounded to single precision
    Eigen::VectorXd b;
    Nodes x;  // [N, 3] positions that the system is linearised at, m
};

/// The systems of the scenes `fly` and `twist` of simulate_scenes(): in the rest pose, and after so many
/// steps. Prescribed nodes have rows of the identity. Contacts are no part of them.
struct StepProblems {
    StepProblem rest, moved;
};
std::vector<StepProblems> step_problems(const Body& body, const std::shared_ptr<const ElasticBody>& elastic,
                                        int steps);

}  // namespace nbd
