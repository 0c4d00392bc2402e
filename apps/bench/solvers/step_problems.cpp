#include "apps/bench/solvers/step_problems.hpp"

#include <utility>

#include "apps/bench/steps/simulate_scenes.hpp"

namespace nbd {
namespace {

StepProblem problem_of(const SimulateScene& scene, const ElasticBody& elastic, const BodyState& state) {
    StepSystem system(elastic);
    system.assemble(state, scene.dt, {});
    PrescribedNodes held;
    for (const Grip& grip : scene.body.grips)
        held.nodes.insert(held.nodes.end(), grip.nodes.begin(), grip.nodes.end());
    held.v = state.v(held.nodes, Eigen::all);
    system.prescribe(held);
    const Nodes x = state.x + scene.dt * state.v;
    SparseMatrix A = system.matrix().to_sparse();
    Eigen::VectorXd b = system.rhs();
    return {scene.name, std::move(system), std::move(A), std::move(b), x};
}

}  // namespace

std::vector<StepProblems> step_problems(const Body& body, const std::shared_ptr<const ElasticBody>& elastic,
                                        int steps) {
    std::vector<StepProblems> problems;
    for (const SimulateScene& scene : simulate_scenes(body, elastic)) {
        if (!scene.obstacles.empty()) continue;
        World world = scene.world({});
        BodyState rest = world.state(0);
        rest.v.setZero();
        for (int k = 0; k < steps; ++k) world.step(scene.dt);
        problems.push_back({problem_of(scene, *elastic, rest), problem_of(scene, *elastic, world.state(0))});
    }
    return problems;
}

}  // namespace nbd
