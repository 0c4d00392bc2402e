#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "apps/cli/output.hpp"
#include "sim/scene/scene.hpp"

namespace nbd {

struct ContactRunConfig {
    int seeds = 1;         // runs of each scene and mode; all but the first start with jittered velocities
    double jitter = 0.05;  // largest change of a body's velocity along each axis, m/s
    double seconds = 600;  // a run is stopped after so long
    std::filesystem::path pictures{};  // folder for SCENE_MODE.png of the first seed; empty: none
};

/// A run of one scene in one mode. Counts are sums over its steps, times are means.
struct ContactRun {
    std::string scene, mode;  // mode: "default", "self" (with self-contact) or "free" of intersections
    int seed = 0, bodies = 0, faces = 0;
    int steps = 0, planned = 0;  // taken, and of the scene
    long intersecting = 0;  // pairs of faces at the ends of steps, obstacles and bodies themselves included
    int worst = 0;          // of these, in one step
    double least_distance = 0;  // of near features at the ends of steps, metres; infinite: nothing was near
    int cut = 0, troubled = 0;  // steps
    int inverted = 0;           // tetrahedra, most in a step
    double momentum_error = 0;  // gain without an impulse, share of the momentum; NaN: no body to compare
    double linearisations = 0;  // a step
    double contacts = 0;
    double ms = 0, search_ms = 0, detect_ms = 0, assemble_ms = 0, solve_ms = 0;  // a step
    double face_pairs = 0;                                                       // looked at in a step
    double patches = 0, patches_proved = 0;  // of bodies with themselves, see WorldReport
    double proof_ms = 0;                     // of these proofs, part of search_ms
    std::string failure{};                   // empty: all steps were taken
};

/// Runs a scene in default mode, with self-contact, and free of intersections: all seeds of a mode, then
/// those of the next.
std::vector<ContactRun> run_contact_scene(const std::filesystem::path& scene, const ContactRunConfig& config,
                                          Output& out);

/// The runs of one scene and mode as one: sums, extremes and means of theirs. `seed` is the number of runs,
/// and `failure` says how many did not take all steps. runs: not empty.
ContactRun together(std::span<const ContactRun> runs);

/// Writes CSV, one line per run, with a comment that names the machine. Atomic.
void write_contact_table(const std::filesystem::path& path, std::span<const ContactRun> runs);

}  // namespace nbd
