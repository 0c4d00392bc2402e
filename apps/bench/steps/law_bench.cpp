#include "apps/bench/steps/law_bench.hpp"

#include <fmt/core.h>

#include <cmath>
#include <numbers>

#include "apps/bench/steps/simulate_scenes.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

/// What the steps of a scene cost in the mean. The first is not timed: it builds hierarchies and scratch.
struct Means {
    double milliseconds = 0, iterations = 0, linearisations = 0, parts = 0;
    std::string failure{};
};

Means run_steps(const SimulateScene& scene, const StepConfig& step, int steps) {
    World world = scene.world({}, step);
    Means sum;
    for (int k = 0; k <= steps; ++k) {
        const Stopwatch watch;
        const WorldReport report = world.step(scene.dt);
        sum.failure = report.failure;
        if (!sum.failure.empty()) break;
        if (k == 0) continue;
        sum.milliseconds += 1e3 * watch.seconds() / steps;
        sum.iterations += static_cast<double>(report.solver_iterations) / steps;
        sum.linearisations += static_cast<double>(report.newton_iterations) / steps;
        sum.parts += static_cast<double>(report.substeps) / steps;
    }
    return sum;
}

const char* name_of(Tangent tangent) { return tangent == Tangent::full ? "full" : "rotated"; }

/// Shares of the first energy after one and ten periods.
Ringing ring_once(const Body& body, const SimulateScene& scene, StepConfig step, double period,
                  int steps_per_period) {
    Ringing row{.body = body.name,
                .law = std::string(name(body.material.law)),
                .integrator = step.integrator == TimeIntegrator::bdf2 ? "bdf2" : "backward_euler",
                .nodes = static_cast<int>(body.tets.X.rows()),
                .steps_per_period = steps_per_period};
    step.newton_iterations = 10;
    step.newton_tolerance = 1e-6;
    World world = scene.world({}, step);
    const double first = world.elastic(0).measure(world.state(0).x).energy;
    for (int k = 1; k <= 10 * steps_per_period; ++k) {
        const WorldReport report = world.step(period / steps_per_period);
        row.failure = report.failure;
        if (!row.failure.empty()) break;
        const double share = (report.kinetic_energy + report.elastic_energy) / first;
        if (k == steps_per_period) row.energy_1 = share;
        row.energy_10 = share;
    }
    return row;
}

}  // namespace

std::vector<LawTiming> time_laws(const Body& body, const LawBenchConfig& config, Output& out) {
    std::vector<LawTiming> rows;
    for (const MaterialLaw law : material_laws)
        for (const Tangent tangent : {Tangent::rotated, Tangent::full}) {
            if (law != MaterialLaw::corotated && tangent == Tangent::full) continue;  // always full
            Body one = body;
            one.material.law = law;
            one.regions.clear();
            for (const SimulateScene& scene :
                 simulate_scenes(one, std::make_shared<const ElasticBody>(one))) {
                out.work(fmt::format("{}, {}, {}", name(law), name_of(tangent), scene.name));
                const Means once = run_steps(scene, {.tangent = tangent}, config.steps);
                const Means newton = run_steps(scene,
                                               {.tangent = tangent,
                                                .newton_iterations = config.newton_iterations,
                                                .newton_tolerance = config.newton_tolerance},
                                               config.steps);
                rows.push_back({.body = body.name,
                                .law = std::string(name(law)),
                                .tangent = law == MaterialLaw::corotated ? name_of(tangent) : "full",
                                .scene = scene.name,
                                .nodes = static_cast<int>(body.tets.X.rows()),
                                .steps = config.steps,
                                .once = once.milliseconds,
                                .iterations_once = once.iterations,
                                .newton = newton.milliseconds,
                                .linearisations = newton.linearisations,
                                .parts = newton.parts,
                                .failure = once.failure.empty() ? newton.failure : once.failure});
            }
        }
    return rows;
}

std::vector<Ringing> ring(const Body& body, double strain, Output& out) {
    std::vector<Ringing> rows;
    for (const MaterialLaw law : material_laws) {
        Body one = body;
        one.material.law = law;
        one.material.rayleigh_mass = one.material.rayleigh_stiffness = 0;
        one.regions.clear();
        SimulateScene scene = simulate_scenes(one, std::make_shared<const ElasticBody>(one)).front();
        Nodes& x = scene.body.state.x;
        Eigen::Index axis = 0;
        const double length = (x.colwise().maxCoeff() - x.colwise().minCoeff()).maxCoeff(&axis);
        const Eigen::ArrayXd along = std::numbers::pi / length * x.col(axis).array();
        x.col(axis).array() += strain * length / std::numbers::pi * along.sin();
        for (int side = 1; side < 3; ++side)  // it becomes thinner by Poisson's ratio where it is stretched
            x.col((axis + side) % 3).array() *= 1 - one.material.poisson * strain * along.cos();
        scene.body.state.v.setZero();
        const double period = 2 * length * std::sqrt(one.material.density / one.material.young);
        for (const int steps : {20, 50, 100})
            for (const TimeIntegrator integrator : {TimeIntegrator::backward_euler, TimeIntegrator::bdf2}) {
                out.work(fmt::format("{}, {} steps a period", name(law), steps));
                rows.push_back(ring_once(one, scene, {.integrator = integrator}, period, steps));
            }
    }
    return rows;
}

void write_table(const std::filesystem::path& path, std::span<const LawTiming> rows) {
    h5::AtomicFile file(path);
    file.out() << "body,nodes,law,tangent,scene,steps,once_ms,iterations_once,newton_ms,linearisations,parts,"
                  "failure\n";
    for (const LawTiming& r : rows)
        file.out() << fmt::format("{},{},{},{},{},{},{:.2f},{:.1f},{:.2f},{:.2f},{:.2f},\"{}\"\n", r.body,
                                  r.nodes, r.law, r.tangent, r.scene, r.steps, r.once, r.iterations_once,
                                  r.newton, r.linearisations, r.parts, r.failure);
    file.commit();
}

void write_table(const std::filesystem::path& path, std::span<const Ringing> rows) {
    h5::AtomicFile file(path);
    file.out() << "body,nodes,law,integrator,steps_per_period,energy_1,energy_10,failure\n";
    for (const Ringing& r : rows)
        file.out() << fmt::format("{},{},{},{},{},{:.4f},{:.4f},\"{}\"\n", r.body, r.nodes, r.law,
                                  r.integrator, r.steps_per_period, r.energy_1, r.energy_10, r.failure);
    file.commit();
}

}  // namespace nbd
