#pragma once

#include <string>

#include "sim/fem/step_report.hpp"

namespace nbd {

/// What a step did, in numbers and in words.
struct WorldReport : StepReport {
    bool contacts_settled = true;  // see ContactSolveReport::settled
    std::string fallback{};  // empty, or one line: why the iterative solver last fell back to a factorisation
    std::string rejection{};       // empty, or one line: why a part of the step was last rejected
    std::string trouble_reason{};  // empty, or one line about `trouble`
    double imbalance = 0;          // of the worst body at the end of a static increment, see StaticConfig
    std::string failure{};  // empty, or one line: why the step failed; the world must not be stepped again
};

}  // namespace nbd
