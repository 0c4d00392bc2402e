#pragma once

#include <span>
#include <string>
#include <vector>

#include "apps/bench/measure/rows.hpp"
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

/// "size 0.1 m, dt 1 ms, 1e+06 Pa, default", and what else is not as usual.
std::string describe(const PhysicsCheck& check, const PhysicsCase& at);

/// A table in Markdown: one row a check, with its worst case.
std::string physics_table(std::span<const PhysicsResult> results);

/// One row per case.
Rows physics_rows(std::span<const PhysicsResult> results);

}  // namespace nbd
