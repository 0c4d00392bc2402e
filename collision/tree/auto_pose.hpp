#pragma once

#include "collision/tree/auto_choice.hpp"

namespace nbd {

/// What `auto` bounds that may be learned keep beside the pose, for their choice.
struct AutoPose {
    AutoChoice choice{};
    bool was_tried = false;                            // by a query of this pose
    AutoChoice::Trial boxes_trial{}, learned_trial{};  // of this pose's queries that used both
    double boxes_work = 0, learned_work = 0;           // of all queries of this pose

    /// Time that this pose took to begin in both trees, so far.
    double starts_ns() const noexcept { return boxes_trial.start_ns + learned_trial.start_ns; }
    void add_trial(const AutoChoice::Trial& boxes, const AutoChoice::Trial& learned) noexcept;
    /// Adds the pose that ends to the choice.
    void end_pose() noexcept;
};

}  // namespace nbd
