#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "apps/cli/output.hpp"
#include "meshing/body/body.hpp"
#include "sim/solvers/coupled_solver.hpp"

namespace nbd {

/// What the scenes of a benchmark are like.
struct SimulateBenchConfig {
    int steps = 40;                                    // per scene, besides the first
    double tolerance = LinearSolveConfig{}.tolerance;  // of both solvers
    double longer = 1;                                 // factor of the scenes' time step
    bool reference = true;  // also steps the factorising solver and the textbook's assembly
};

/// Medians over the steps of one scene, in milliseconds, for the iterative and the direct solver, stepped
/// alternately.
struct SimulateTiming {
    std::string body, scene;
    int nodes = 0, tets = 0, steps = 0;
    double step = 0, assemble = 0, solve = 0;                       // iterative
    double direct_step = 0, direct_assemble = 0, direct_solve = 0;  // one factorisation per step
    double iterations = 0;
    double bytes_per_node = 0;                        // heap that the iterative solver's world holds
    int fallbacks = 0;                                // steps of the iterative solver that were factorised
    double ours_assembly = 0, textbook_assembly = 0;  // of the scene's poses
    double difference = 0;  // largest difference of end positions, relative to the body's diagonal
    std::string failure{};

    bool has_reference() const { return direct_step > 0; }
    double step_ratio() const { return direct_step / step; }
    double assembly_ratio() const { return has_reference() ? textbook_assembly / ours_assembly : 0; }
};

/// Times all scenes of simulate_scenes().
std::vector<SimulateTiming> time_simulation(const Body& body, const SimulateBenchConfig& config, Output& out);

/// Writes CSV, one line per row. Atomic.
void write_simulate_table(const std::filesystem::path& path, std::span<const SimulateTiming> rows);

/// Exponent p of cost ~ nodes^p between the smallest and the largest mesh, for one scene.
double growth(std::span<const SimulateTiming> rows, const std::string& scene);

}  // namespace nbd
