#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/measure/measure.hpp"
#include "apps/bench/measure/rows.hpp"
#include "apps/cli/mesh_file.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "collision/base/stopwatch.hpp"
#include "sim/factor/blas.hpp"
#include "sim/world/world.hpp"

namespace nbd {
namespace {

struct BenchSimulateArguments {
    std::vector<std::string> bodies;
    std::string csv;
    std::vector<int> nodes{2500, 5000, 10000};
    int steps = 40;                                    // per scene, besides the first
    double tolerance = LinearSolveConfig{}.tolerance;  // of both solvers
    bool alone = false;                                // without the factorising solver
};

/// The bodies of one argument: the body of a body file, or a surface meshed at each size.
std::vector<Body> bodies_of(const std::string& path, const std::vector<int>& nodes, const Output& out) {
    if (std::filesystem::path(path).extension() == ".h5") return {load_body(path)};
    std::vector<Body> bodies;
    for (const int count : nodes) {
        MeshFileConfig config;
        config.tets.nodes = count;
        bodies.push_back(mesh_file(path, config, out).body);
    }
    return bodies;
}

/// A scene to time the solvers on. Sound crosses the body in ten steps.
struct SimulateScene {
    std::string name;
    WorldBody body;
    std::vector<Obstacle> obstacles;
    Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
    double dt = 0;  // seconds

    World world(const LinearSolveConfig& linear) const {
        World result({.gravity = gravity, .linear = linear});
        result.add_body(body);
        for (const Obstacle& obstacle : obstacles) result.add_obstacle(obstacle);
        return result;
    }
};

/// Nodes within a tenth of the body's length from one of its ends along an axis.
std::vector<int> end_nodes(const Nodes& X, Eigen::Index axis, bool upper) {
    const double low = X.col(axis).minCoeff(), high = X.col(axis).maxCoeff();
    std::vector<int> nodes;
    for (int i = 0; i < X.rows(); ++i) {
        const double along = (X(i, axis) - low) / (high - low);
        if (upper ? along > 0.9 : along < 0.1) nodes.push_back(i);
    }
    return nodes;
}

/// `fly`: a free body that spins and shears; `twist`: a body held at both ends of its longest axis, one of
/// which makes half a turn; `drop`: a body thrown onto a floor.
std::vector<SimulateScene> simulate_scenes(const Body& body,
                                           const std::shared_ptr<const ElasticBody>& elastic) {
    const Nodes X = body.tets.X.rowwise() - body.tets.X.colwise().mean();
    const Material material = mean_material(body);
    const Eigen::RowVector3d extent = X.colwise().maxCoeff() - X.colwise().minCoeff();
    const double length = extent.norm(), speed = std::sqrt(material.young / material.density),
                 time = length / speed;
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
    extent.maxCoeff(&axis);
    twist.body.grips = {{.nodes = end_nodes(X, axis, false)},
                        {.nodes = end_nodes(X, axis, true),
                         .motion = eased({.rotation = std::numbers::pi * Eigen::Vector3d::Unit(axis),
                                          .duration = 60 * twist.dt})}};

    SimulateScene& drop = scenes[2];
    drop.name = "drop";
    drop.gravity = {0, 0, -9.81};
    drop.body.state.v.col(2).setConstant(-0.3 * speed);
    drop.obstacles = {{.shape = PlaneShape{.point = {0, 0, X.col(2).minCoeff() - 0.02 * length},
                                           .normal = Eigen::Vector3d::UnitZ()}}};
    return scenes;
}

/// A world and the cost of its steps, ms.
struct Course {
    World world;
    std::vector<double> step{}, assemble{}, solve{}, iterations{};

    WorldReport advance(double dt) {
        const Stopwatch watch;
        WorldReport report = world.step(dt);
        step.push_back(1e3 * watch.seconds());
        assemble.push_back(report.assemble_us / 1000);
        solve.push_back(report.solve_us / 1000);
        iterations.push_back(report.solver_iterations);
        return report;
    }

    void forget() {
        for (std::vector<double>* times : {&step, &assemble, &solve, &iterations}) times->clear();
    }
};

/// Steps both solvers in turns. Times are medians over the steps, in milliseconds.
nlohmann::ordered_json time_scene(const Body& body, const ElasticBody& elastic, const SimulateScene& scene,
                                  const BenchSimulateArguments& arguments, Output& out) {
    const std::size_t before = heap_bytes();
    Course iterative{scene.world({.tolerance = arguments.tolerance})};
    std::optional<Course> direct;
    if (!arguments.alone)
        direct.emplace(scene.world({.solver = LinearSolver::direct, .tolerance = arguments.tolerance}));
    double bytes_per_node = 0, difference = 0;
    int steps = 0, fallbacks = 0;
    std::string failure;
    for (int k = 0; k <= arguments.steps && failure.empty(); ++k) {
        const WorldReport ours = iterative.advance(scene.dt);
        fallbacks += !ours.fallback.empty();
        failure = ours.failure;
        if (k == 0 && !direct)
            bytes_per_node = static_cast<double>(heap_bytes() - before) / elastic.node_count();
        if (direct) {
            const WorldReport theirs = direct->advance(scene.dt);
            if (failure.empty()) failure = theirs.failure;
        }
        if (k == 0) {  // the first step builds the hierarchies and grows the scratch, so it is not counted
            iterative.forget();
            if (direct) direct->forget();
        }
        steps += failure.empty();
        out.progress(fmt::format("{} {} nodes, {}", body.name, elastic.node_count(), scene.name), k,
                     arguments.steps);
    }
    const double step = median(iterative.step), direct_step = direct ? median(direct->step) : 0;
    if (direct)
        difference = (iterative.world.state(0).x - direct->world.state(0).x).rowwise().norm().maxCoeff() /
                     (body.surface.X.colwise().maxCoeff() - body.surface.X.colwise().minCoeff()).norm();
    return {{"body", body.name},
            {"nodes", elastic.node_count()},
            {"tets", elastic.element_count()},
            {"scene", scene.name},
            {"steps", steps},
            {"step_ms", step},
            {"assemble_ms", median(iterative.assemble)},
            {"solve_ms", median(iterative.solve)},
            {"direct_step_ms", direct_step},
            {"direct_assemble_ms", direct ? median(direct->assemble) : 0},
            {"direct_solve_ms", direct ? median(direct->solve) : 0},
            {"step_ratio", direct_step / step},
            {"iterations", median(iterative.iterations)},
            {"fallbacks", fallbacks},
            {"relative_difference", difference},  // of end positions, by the body's diagonal
            {"bytes_per_node", bytes_per_node},   // of the heap, that the iterative solver's world holds
            {"failure", failure}};
}

void run(const BenchSimulateArguments& arguments, Output& out) {
    hold_blas_to_one_thread();
    if (const BlasInfo blas = blas_info(); !blas.fast) out.warning(blas.warning);
    if (!arguments.csv.empty())
        check_output(arguments.csv, {arguments.bodies.begin(), arguments.bodies.end()}, ".csv");
    out.text(fmt::format("medians in ms per step; residuals of both solvers: {:g} of the impulses",
                         arguments.tolerance));
    std::vector<std::string> shown{"body",        "nodes",    "scene",     "step_ms",
                                   "assemble_ms", "solve_ms", "iterations"};
    if (arguments.alone)
        shown.emplace_back("bytes_per_node");
    else
        shown.insert(shown.end(), {"direct_step_ms", "step_ratio", "relative_difference"});
    shown.emplace_back("failure");
    Rows rows;
    for (const std::string& path : arguments.bodies)
        for (const Body& body : bodies_of(path, arguments.nodes, out)) {
            const auto elastic = std::make_shared<const ElasticBody>(body);
            for (const SimulateScene& scene : simulate_scenes(body, elastic))
                rows.push_back(time_scene(body, *elastic, scene, arguments, out));
        }
    out.text(to_text(rows, shown));
    if (!arguments.csv.empty()) write_csv(arguments.csv, rows);
    out.result(rows);
}

}  // namespace

void add_bench_simulate(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<BenchSimulateArguments>(
        app, out, "simulate", "Times steps beside steps with one factorisation each, in one run", run);
    command.add_option("BODIES", arguments.bodies, "Body files, or surfaces to mesh at several sizes")
        ->required();
    command.add_option("--nodes", arguments.nodes, "Sizes for surfaces, in tet nodes")
        ->delimiter(',')
        ->check(whole_number(8, 10'000'000));
    command.add_option("--steps", arguments.steps, "Steps per scene; the first is not counted")
        ->check(whole_number(2, 1'000'000));
    command
        .add_option("--tolerance", arguments.tolerance,
                    "Residual of the linear solves, relative to a body's impulses")
        ->check(between(1e-12, 0.5));
    command.add_flag("--alone", arguments.alone,
                     "Without the factorising solver, which takes minutes a step on large bodies; "
                     "tells memory instead");
    command.add_option("-o,--output", arguments.csv, "Table to write, CSV");
}

}  // namespace nbd
