#pragma once

#include <string>
#include <vector>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/cli/output.hpp"

namespace nbd {

struct PhysicsRow {
    PhysicsCase at;
    PhysicsOutcome found;
    double seconds = 0;  // of the processor
};

/// A check over its range.
struct PhysicsResult {
    PhysicsCheck check;  // `cases` are those that ran
    std::vector<PhysicsRow> rows;

    const PhysicsRow& worst() const;  // the first of the largest error
    bool held() const { return worst().found.error <= check.allowed; }
    int failed() const;  // cases with a larger error than allowed
    double seconds() const;
};

/// Runs all cases, or the quick ones, as many at a time as TBB may use threads; each on one thread. Checks
/// without a case are left out. The outcomes do not depend on the number of threads.
std::vector<PhysicsResult> run_physics(const std::vector<PhysicsCheck>& checks, bool quick, Output& out);

}  // namespace nbd
