#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/simulate/audit.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "sim/fem/step_report.hpp"

namespace nbd {

/// One line of the table. Only plain values, so that a journal can store it.
struct StepRow : StepReport {
    int frame = 0;                      // that the step belongs to
    std::optional<AuditCount> audit{};  // of the frame that the step ends
};

/// A whole run.
struct StepTotals {
    /// Counts and times are sums, `time` is that of the last step; the least distance and the most tetrahedra
    /// that were inside out at the end of a step.
    StepReport all{};
    int steps = 0, frames_in_contact = 0;
    int troubled_steps = 0;
    int otherwise_troubled_steps = 0;  // of these, those with another trouble than `inverted`
    int inverted_steps = 0;            // those that end with inverted tetrahedra
    double first_inverted = 0;         // seconds, end of the first such step
    int audited_frames = 0;
    AuditCount audit{};

    /// Per step, of a count or a time.
    template <class Number>
    double mean(Number StepReport::*number) const noexcept {
        return double(all.*number) / (steps > 0 ? steps : 1);
    }
    double search_us() const noexcept {  // for near face pairs, per step
        return mean(&StepReport::update_us) + mean(&StepReport::collision_us);
    }
    /// Name and mean per step of each time in the table; together they are the whole time of a step.
    std::vector<std::pair<std::string, double>> times() const;
    double step_us() const;
};

/// Results of a scene's steps: their totals and, where a file is named, a row for each. Memory does not grow
/// with the steps.
class StepTable {
 public:
    /// Totals alone.
    StepTable() = default;
    /// Also writes CSV, one line per step: the columns of `step_numbers` in their units, and what an audit of
    /// the frame found in its last step. The file appears at finish(). Throws std::runtime_error if it cannot
    /// be created.
    explicit StepTable(const std::filesystem::path& path);

    void add(const std::vector<StepRow>& rows);
    const StepTotals& totals() const noexcept { return totals_; }
    /// Throws std::runtime_error if a row could not be written.
    void finish();

 private:
    void write(const StepRow& row);

    StepTotals totals_;
    int last_frame_in_contact_ = 0;
    std::optional<h5::AtomicFile> file_;
};

}  // namespace nbd
