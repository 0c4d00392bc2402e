#pragma once

#include <limits>
#include <variant>

namespace nbd {

/// Why a step went wrong although its end was kept: it was rejected and could not be cut further, or what is
/// wrong shows only at its end.
enum class StepTrouble {
    none,
    approach,        // a body and a sphere approach each other too fast to be kept apart
    linear_solver,   // a linear system was not solved to its tolerance
    newton,          // Newton's iteration did not reach balance
    contact_passes,  // the passes that settle which contacts press and slip ran out
    joint,           // a joint gives by more than JointBonds::most_give()
    inverted,        // tetrahedra are inside out at the end of the step
};

/// Whether a pose after such a step should not be trained on.
constexpr bool spoils_pose(StepTrouble trouble) noexcept {
    return trouble != StepTrouble::none && trouble != StepTrouble::contact_passes;
}

/// Name in tables, for example "linear_solver"; empty for none.
const char* name(StepTrouble trouble) noexcept;

/// What a step did, in numbers; `step_numbers` says what each one is. Counts and times are sums over the
/// parts of a step, rejected ones included.
struct StepReport {
    double time = 0;
    int contacts = 0;
    long face_pairs = 0, nodes_bounded = 0, nodes_out_of_range = 0;
    double update_us = 0, collision_us = 0, detect_us = 0, assemble_us = 0, solve_us = 0, rest_us = 0;
    int substeps = 0, exact_parts = 0, newton_iterations = 0, solver_iterations = 0;
    bool solver_converged = true;
    double kinetic_energy = 0, elastic_energy = 0, gravity_energy = 0;
    int inverted_elements = 0;
    StepTrouble trouble = StepTrouble::none;
    double least_distance = std::numeric_limits<double>::infinity();

    /// Adds the counts and times of another part, or of another step.
    void add(const StepReport& other);
};

/// How tables, --json and Python show a number of a StepReport.
struct StepNumber {
    const char* name;
    const char* unit;  // "s", "us", "m" or "J"; empty: a count, yes or no, or a word
    const char* text;
    std::variant<int StepReport::*, long StepReport::*, double StepReport::*, bool StepReport::*,
                 StepTrouble StepReport::*>
        member;
    bool adds = false;  // over parts and over steps
};

/// All numbers of a step, in the order of the table's columns.
inline constexpr StepNumber step_numbers[] = {
    {"time", "s", "end of the step", &StepReport::time},
    {"contacts", "", "contacts that press, in the last part of the step", &StepReport::contacts},
    {"face_pairs", "", "face pairs that the bounds found near each other: no more can touch",
     &StepReport::face_pairs, true},
    {"nodes_bounded", "", "bounds of tree nodes that were computed", &StepReport::nodes_bounded, true},
    {"nodes_out_of_range", "", "of these, computed exactly since the input was out of the calibrated range",
     &StepReport::nodes_out_of_range, true},
    {"update_us", "us", "to start the poses of surfaces and trees", &StepReport::update_us, true},
    {"collision_us", "us", "queries for face pairs", &StepReport::collision_us, true},
    {"detect_us", "us", "to find the contacts among these pairs and with obstacles, and how far all may move",
     &StepReport::detect_us, true},
    {"assemble_us", "us", "to assemble the linear systems", &StepReport::assemble_us, true},
    {"solve_us", "us", "linear solves, contact iterations included", &StepReport::solve_us, true},
    {"rest_us", "us", "all else in the step", &StepReport::rest_us, true},
    {"substeps", "", "equal parts of the step; 1: it was not cut", &StepReport::substeps},
    {"exact_parts", "",
     "parts solved anew with exact bounds, where a miss would have left surfaces intersecting or too near",
     &StepReport::exact_parts, true},
    {"newton_iterations", "", "linearisations of elasticity", &StepReport::newton_iterations, true},
    {"solver_iterations", "", "iterations of conjugate gradients", &StepReport::solver_iterations, true},
    {"solver_converged", "", "whether all linear systems of the parts that were kept met their tolerance",
     &StepReport::solver_converged},
    {"kinetic_energy", "J", "at the end of the step", &StepReport::kinetic_energy},
    {"elastic_energy", "J", "at the end of the step", &StepReport::elastic_energy},
    {"gravity_energy", "J", "at the end of the step; 0 at the origin", &StepReport::gravity_energy},
    {"inverted_elements", "", "tetrahedra that are inside out at the end of the step",
     &StepReport::inverted_elements},
    {"trouble", "",
     "what went wrong first although the end was kept: approach, linear_solver, newton, contact_passes, "
     "joint or inverted; the last three only if there was no other",
     &StepReport::trouble},
    {"least_distance", "m",
     "of two features nearer than the contact distance at the end of the step; infinite if there are none",
     &StepReport::least_distance},
};

}  // namespace nbd
