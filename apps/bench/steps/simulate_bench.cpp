#include "apps/bench/steps/simulate_bench.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "apps/bench/measure/measure.hpp"
#include "apps/bench/steps/textbook_assembly.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/body/body.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "sim/world/world.hpp"

namespace nbd {
namespace {

/// A scene to time the solvers on. Sound crosses the body in ten steps.
struct SimulateScene {
    std::string name;
    WorldBody body;
    std::vector<Obstacle> obstacles;
    Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
    double dt = 0;  // seconds

    World world(const LinearSolveConfig& linear) const;
};

/// Nodes within a `share` of the body's length from one of its ends along an axis.
std::vector<int> end_nodes(const Nodes& X, int axis, bool upper, double share) {
    const double low = X.col(axis).minCoeff(), high = X.col(axis).maxCoeff();
    std::vector<int> nodes;
    for (int i = 0; i < X.rows(); ++i) {
        const double along = (X(i, axis) - low) / (high - low);
        if (upper ? along > 1 - share : along < share) nodes.push_back(i);
    }
    return nodes;
}

World SimulateScene::world(const LinearSolveConfig& linear) const {
    WorldConfig config;
    config.gravity = gravity;
    config.linear = linear;
    World result(config);
    result.add_body(body);
    for (const Obstacle& obstacle : obstacles) result.add_obstacle(obstacle);
    return result;
}

/// `fly`: a free body that spins and shears; `twist`: a body held at both ends of its longest axis, one of
/// which makes half a turn; `drop`: a body thrown onto a floor.
std::vector<SimulateScene> simulate_scenes(const Body& body,
                                           const std::shared_ptr<const ElasticBody>& elastic) {
    const Nodes X = body.tets.X.rowwise() - body.tets.X.colwise().mean();
    const Material material = mean_material(body);
    const double length = (X.colwise().maxCoeff() - X.colwise().minCoeff()).norm(),
                 speed = std::sqrt(material.young / material.density), time = length / speed;
    SimulateScene still{.name = {},
                        .body = {.elastic = elastic, .W = body.W, .F = body.surface.F},
                        .obstacles = {},
                        .dt = 0.1 * time};
    still.body.state = {X, Nodes::Zero(X.rows(), 3)};
    std::vector<SimulateScene> scenes(3, still);

    SimulateScene& fly = scenes[0];
    fly.name = "fly";
    const double rate = 0.5 / time;
    Eigen::Matrix3d gradient;
    gradient << 0.4, -1, 0.8, 1, -0.4, 0, 0.2, 0, 0;
    fly.body.state.v = X * (rate * gradient).transpose();

    SimulateScene& twist = scenes[1];
    twist.name = "twist";
    Eigen::Index axis = 0;
    (X.colwise().maxCoeff() - X.colwise().minCoeff()).maxCoeff(&axis);
    const int along = axis;
    twist.body.grips = {{.nodes = end_nodes(X, along, false, 0.1)},
                        {.nodes = end_nodes(X, along, true, 0.1),
                         .rotation = std::numbers::pi * Eigen::Vector3d::Unit(along),
                         .duration = 60 * twist.dt}};

    SimulateScene& drop = scenes[2];
    drop.name = "drop";
    drop.gravity = {0, 0, -9.81};
    drop.body.state.v.col(2).setConstant(-0.3 * speed);
    drop.obstacles = {{.shape = PlaneShape{.point = {0, 0, X.col(2).minCoeff() - 0.02 * length},
                                           .normal = Eigen::Vector3d::UnitZ()}}};
    return scenes;
}

double milliseconds(auto&& work) {
    const Stopwatch watch;
    work();
    return 1e3 * watch.seconds();
}

/// A world and the cost of its steps.
struct Course {
    World world;
    std::vector<double> step{}, assemble{}, solve{}, iterations{};

    void forget() {
        for (std::vector<double>* times : {&step, &assemble, &solve, &iterations}) times->clear();
    }

    WorldReport advance(double dt) {
        WorldReport report;
        step.push_back(milliseconds([&] { report = world.step(dt); }));
        assemble.push_back(report.assemble_us / 1000);
        solve.push_back(report.solve_us / 1000);
        iterations.push_back(report.solver_iterations);
        return report;
    }
};

/// Times both assemblies of the same pose.
class AssemblyRace {
 public:
    explicit AssemblyRace(const ElasticBody& body)
        : body_(body),
          textbook_(body),
          ours_(body.zero_matrix()),
          theirs_(body.pattern().zero_matrix()),
          force_(body.node_count(), 3) {}

    void run(const Nodes& x) {
        ours.push_back(milliseconds([&] {
            body_.pose(x, pose_, forces_);
            body_.sum_forces(forces_, force_);
            body_.combine(1, 1e-4, pose_, ours_);
        }));
        textbook.push_back(milliseconds([&] { textbook_.assemble(x, 1, 1e-4, force_, theirs_); }));
    }

    std::vector<double> ours, textbook;

 private:
    const ElasticBody& body_;
    TextbookAssembly textbook_;
    ElementPose pose_;
    ElementForces forces_;
    StepMatrix ours_;
    SparseMatrix theirs_;
    Nodes force_;
};

/// The factorising solver and the textbook's assembly, in the same scene.
struct Reference {
    Course direct;
    AssemblyRace race;
};

SimulateTiming time_scene(const Body& body, const ElasticBody& elastic, const SimulateScene& scene,
                          const SimulateBenchConfig& config, Output& out) {
    SimulateTiming row{.body = body.name,
                       .scene = scene.name,
                       .nodes = elastic.node_count(),
                       .tets = elastic.element_count()};
    const std::size_t before = heap_bytes();
    Course iterative{scene.world({.tolerance = config.tolerance})};
    std::optional<Reference> reference;
    if (config.reference)
        reference.emplace(
            Course{scene.world({.solver = LinearSolver::direct, .tolerance = config.tolerance})},
            AssemblyRace(elastic));
    const double dt = config.longer * scene.dt;
    for (int k = 0; k <= config.steps; ++k) {
        const WorldReport ours = iterative.advance(dt);
        row.fallbacks += !ours.fallback.empty();
        row.failure = ours.failure;
        if (k == 0 && !reference) row.bytes_per_node = static_cast<double>(heap_bytes() - before) / row.nodes;
        if (reference) {
            const WorldReport direct = reference->direct.advance(dt);
            if (row.failure.empty()) row.failure = direct.failure;
            reference->race.run(iterative.world.state(0).x);
        }
        if (!row.failure.empty()) break;
        if (k == 0) {  // the first step builds the hierarchies and grows the scratch, so it is not counted
            iterative.forget();
            if (reference) {
                reference->direct.forget();
                reference->race.ours.clear();
                reference->race.textbook.clear();
            }
        }
        ++row.steps;
        out.progress(fmt::format("{} {} nodes, {}", row.body, row.nodes, row.scene), k, config.steps);
    }
    row.step = median(iterative.step);
    row.assemble = median(iterative.assemble);
    row.solve = median(iterative.solve);
    row.iterations = median(iterative.iterations);
    if (!reference) return row;
    row.direct_step = median(reference->direct.step);
    row.direct_assemble = median(reference->direct.assemble);
    row.direct_solve = median(reference->direct.solve);
    row.ours_assembly = median(reference->race.ours);
    row.textbook_assembly = median(reference->race.textbook);
    const Nodes difference = iterative.world.state(0).x - reference->direct.world.state(0).x;
    row.difference = difference.rowwise().norm().maxCoeff() /
                     (body.surface.X.colwise().maxCoeff() - body.surface.X.colwise().minCoeff()).norm();
    return row;
}

}  // namespace

std::vector<SimulateTiming> time_simulation(const Body& body, const SimulateBenchConfig& config,
                                            Output& out) {
    const auto elastic = std::make_shared<const ElasticBody>(body);
    std::vector<SimulateTiming> rows;
    for (const SimulateScene& scene : simulate_scenes(body, elastic))
        rows.push_back(time_scene(body, *elastic, scene, config, out));
    return rows;
}

void write_simulate_table(const std::filesystem::path& path, std::span<const SimulateTiming> rows) {
    h5::AtomicFile file(path);
    file.out()
        << "body,nodes,tets,scene,steps,step_ms,assemble_ms,solve_ms,direct_step_ms,direct_assemble_ms,"
           "direct_solve_ms,step_ratio,iterations,fallbacks,assembly_ms,"
           "textbook_assembly_ms,assembly_ratio,relative_difference,bytes_per_node,failure\n";
    for (const SimulateTiming& r : rows)
        file.out() << fmt::format(
            "{},{},{},{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.2f},{},{},{:.3f},"
            "{:.3f},{:.2f},{:.2g},{:.0f},{}\n",
            r.body, r.nodes, r.tets, r.scene, r.steps, r.step, r.assemble, r.solve, r.direct_step,
            r.direct_assemble, r.direct_solve, r.step_ratio(), r.iterations, r.fallbacks, r.ours_assembly,
            r.textbook_assembly, r.assembly_ratio(), r.difference, r.bytes_per_node, r.failure);
    file.commit();
}

double growth(std::span<const SimulateTiming> rows, const std::string& scene) {
    const SimulateTiming *small = nullptr, *large = nullptr;
    for (const SimulateTiming& row : rows) {
        if (row.scene != scene) continue;
        if (!small || row.nodes < small->nodes) small = &row;
        if (!large || row.nodes > large->nodes) large = &row;
    }
    if (!small || small->nodes == large->nodes) return std::numeric_limits<double>::quiet_NaN();
    return std::log(large->step / small->step) / std::log(static_cast<double>(large->nodes) / small->nodes);
}

}  // namespace nbd
