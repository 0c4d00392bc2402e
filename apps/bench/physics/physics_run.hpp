#pragma once

#include <filesystem>
#include <span>
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

/// "size 0.1 m, dt 1 ms, 1e+06 Pa, default", and what else is not as usual.
std::string describe(const PhysicsCheck& check, const PhysicsCase& at);

/// A table in Markdown: one row a check, with its worst case.
std::string physics_table(std::span<const PhysicsResult> results);

/// Writes CSV, one line per case. Atomic.
void write_physics_cases(const std::filesystem::path& path, std::span<const PhysicsResult> results);

/// A check that does not hold at present, with the number of cases that fail and the largest error.
struct KnownFault {
    std::string check;
    int failed = 0;
    double error = 0;
};

/// Reads the CSV that write_known_faults() writes. Throws std::runtime_error with path and line.
std::vector<KnownFault> read_known_faults(const std::filesystem::path& path);

/// Writes the checks that do not hold. Atomic.
void write_known_faults(const std::filesystem::path& path, std::span<const PhysicsResult> results);

/// What differs from the list, one line each: a check that fails and is not listed, one of which more cases
/// fail or whose error grew by more than `slack`, relative, and a listed one that holds now. Checks that did
/// not run are passed over.
std::vector<std::string> changes(std::span<const PhysicsResult> results, std::span<const KnownFault> known,
                                 double slack = 0.1);

}  // namespace nbd
