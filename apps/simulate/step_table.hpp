#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <vector>

#include "apps/simulate/audit.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// Results of one step, one line of the table. Only plain values, so that a journal can store it.
struct StepRow {
    int frame = 0;  // that the step belongs to
    double time = 0;
    int contacts = 0, substeps = 0, newton_iterations = 0, solver_iterations = 0, inverted_elements = 0;
    bool solver_converged = true, audited = false;
    long face_pairs = 0, pairs_measured = 0, nodes_bounded = 0, nodes_out_of_range = 0;
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
    int otherwise_troubled_steps = 0;  // of these, those with another trouble than `inverted`
    int inverted_steps = 0;            // those that end with inverted tetrahedra
    int most_inverted = 0;             // tetrahedra, at the end of one step
    double first_inverted = 0;         // seconds, end of the first such step
    double least_distance = std::numeric_limits<double>::infinity();
    int audited_frames = 0;
    AuditCount audit;

    double search_us() const noexcept { return update_us + collision_us; }  // for near face pairs
    double step_us() const noexcept { return search_us() + detect_us + assemble_us + solve_us + rest_us; }
};

/// Results of a scene's steps: their totals and, where a file is named, a row for each. Memory does not grow
/// with the steps.
class StepTable {
 public:
    /// Totals alone.
    StepTable() = default;
    /// Also writes CSV, one line per step: SI units, costs in microseconds; an audited frame's pairs are in
    /// its last step. The file appears at finish(). Throws std::runtime_error if it cannot be created.
    explicit StepTable(const std::filesystem::path& path);

    void add(const std::vector<StepRow>& rows);
    StepTotals totals() const;
    /// Throws std::runtime_error if a row could not be written.
    void finish();

 private:
    void write(const StepRow& row);

    StepTotals sums_;  // of costs, too
    int last_frame_in_contact_ = 0;
    std::optional<h5::AtomicFile> file_;
};

}  // namespace nbd
