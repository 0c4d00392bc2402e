#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "apps/audit.hpp"
#include "sim/world.hpp"

namespace nbd {

/// Sums and means over a whole run. Costs are means a step.
struct StepTotals {
    double time = 0;  // seconds simulated
    int frames_in_contact = 0;
    double deepest_penetration = 0;  // metres
    double update_us = 0, collision_us = 0, nodes_bounded = 0;
    int audited_frames = 0;
    AuditCount audit;
};

/// What a scene's steps did, a row a frame.
class StepTable {
 public:
    void add_step(const WorldReport& report);
    void add_audit(const AuditCount& count) { open_.audit = count; }
    void end_frame();

    int frames() const { return static_cast<int>(rows_.size()); }
    StepTotals totals() const;

    /// CSV: time, contacts and face pairs at the frame's last step, costs as means a step, the solver's
    /// iterations as a sum, energies at the frame's end, the audit where there was one. Atomic.
    void write(const std::filesystem::path& path) const;

 private:
    struct Row {
        int steps = 0;
        WorldReport last;
        double update_us = 0, collision_us = 0, nodes_bounded = 0;  // sums over the steps
        int solver_iterations = 0;
        double deepest_penetration = 0;
        std::optional<AuditCount> audit;
    };
    Row open_;
    std::vector<Row> rows_;
};

}  // namespace nbd
