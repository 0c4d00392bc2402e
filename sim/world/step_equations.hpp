#pragma once

#include <vector>

#include "sim/contact/contact_solver.hpp"
#include "sim/fem/step_system.hpp"

namespace nbd {

/// The equations of a part of a step, and what solves them.
struct StepEquations {
    std::vector<StepSystem> systems{};          // of each body
    std::vector<TimeStep> steps{};              // likewise
    std::vector<const ContactShape*> shapes{};  // likewise
    std::vector<Contact> contacts{};
    std::vector<Bond> bonds{};
    ContactSolver solver;
    /// Whether the unknowns that were found balance the bodies themselves, rather than a linearisation.
    bool are_balanced = false;
};

}  // namespace nbd
