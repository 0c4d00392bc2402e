#pragma once

#include <filesystem>
#include <limits>
#include <vector>

#include "apps/simulate/audit.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// Results of one step, one line of the table. Only plain values, so that a journal can store it.
struct StepRow {
    int frame = 0;  // that the step belongs to
    double time = 0;
    int contacts = 0, substeps = 0, newton_iterations = 0, solver_iterations = 0, inverted_elements = 0;
    bool solver_converged = true, audited = false;
    long face_pairs = 0, nodes_bounded = 0, nodes_out_of_range = 0;
    double kinetic_energy = 0, elastic_energy = 0, gravity_energy = 0, deepest_penetration = 0;
    double update_us = 0, collision_us = 0, detect_us = 0, assemble_us = 0, solve_us = 0,
           rest_us = 0;  // measured; all other values are the same in every run
    AuditCount audit{};
    StepTrouble trouble = StepTrouble::none;
    double least_distance = 0;  // see WorldReport
};

StepRow step_row(int frame, const WorldReport& report);

/// Sums and means over a whole run. Costs are means per step.
struct StepTotals {
    double time = 0;  // seconds simulated
    int steps = 0, frames_in_contact = 0;
    double deepest_penetration = 0;  // metres
    double update_us = 0, collision_us = 0, detect_us = 0, assemble_us = 0, solve_us = 0, rest_us = 0;
    double nodes_bounded = 0;
    long nodes_out_of_range = 0;
    int troubled_steps = 0;
    double least_distance = std::numeric_limits<double>::infinity();
    int audited_frames = 0;
    AuditCount audit;

    double search_us() const noexcept { return update_us + collision_us; }  // for near face pairs
    double step_us() const noexcept { return search_us() + detect_us + assemble_us + solve_us + rest_us; }
};

/// Results of a scene's steps, one row per step.
class StepTable {
 public:
    void add(const std::vector<StepRow>& rows) { rows_.insert(rows_.end(), rows.begin(), rows.end()); }
    StepTotals totals() const;

    /// Writes CSV, one line per step: SI units, costs in microseconds; an audited frame's pairs are in its
    /// last step.
    /// Atomic.
    void write(const std::filesystem::path& path) const;

 private:
    std::vector<StepRow> rows_;
};

}  // namespace nbd
