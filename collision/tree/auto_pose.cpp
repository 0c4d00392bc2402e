#include "collision/tree/auto_pose.hpp"

#include <utility>

namespace nbd {

void AutoPose::add_trial(const AutoChoice::Trial& boxes, const AutoChoice::Trial& learned) noexcept {
    was_tried = true;
    for (const auto& [sum, trial] : {std::pair(&boxes_trial, &boxes), {&learned_trial, &learned}}) {
        sum->query_ns += trial->query_ns;
        sum->work += trial->work;
    }
}

void AutoPose::end_pose() noexcept {
    if (was_tried)
        choice.take_trial(boxes_trial, learned_trial);
    else if (boxes_work + learned_work > 0)
        choice.take_pose(boxes_work, learned_work);
    *this = {.choice = choice};
}

}  // namespace nbd
