#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "apps/cli/output.hpp"
#include "meshing/body/body.hpp"

namespace nbd {

/// Steps of a scene (see simulate_scenes()) with one law of elasticity. All times are means, in milliseconds.
struct LawTiming {
    std::string body, law, tangent, scene;
    int nodes = 0, steps = 0;
    double once = 0;             // a step of one linearisation
    double iterations_once = 0;  // of conjugate gradients in it
    double newton = 0;  // a step of Newton's iteration to its tolerance, cut where that takes too long
    double linearisations = 0;  // in it
    double parts = 0;           // into which it was cut
    std::string failure{};
};

struct LawBenchConfig {
    int steps = 20;
    double newton_tolerance = 1e-3;
    int newton_iterations = 20;  // at most, before a step is cut
};

/// Every law with its tangents, in every scene.
std::vector<LawTiming> time_laws(const Body& body, const LawBenchConfig& config, Output& out);

/// Energy of an undamped body that vibrates along its longest axis after it was stretched by `strain`.
struct Ringing {
    std::string body, law, integrator;
    int nodes = 0, steps_per_period = 0;
    double energy_1 = 0, energy_10 = 0;  // after 1 and 10 periods, as a share of that at the start
    std::string failure{};
};

/// A period is the time in which sound passes twice along the body's longest side.
std::vector<Ringing> ring(const Body& body, double strain, Output& out);

/// Write CSV, one line per row. Atomic.
void write_table(const std::filesystem::path& path, std::span<const LawTiming> rows);
void write_table(const std::filesystem::path& path, std::span<const Ringing> rows);

}  // namespace nbd
