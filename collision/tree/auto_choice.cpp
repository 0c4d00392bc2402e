#include "collision/tree/auto_choice.hpp"

#include <algorithm>

namespace nbd {
namespace {

/// The price of work is that of the trials with the most work, and among those with an eighth of it or more
/// the lowest: a trial that waited for the processor, or did next to nothing, must not set a price.
void take(BoundsCost& cost, const AutoChoice::Trial& trial) noexcept {
    cost.start_ns = std::min(cost.start_ns, trial.start_ns);
    if (!(trial.work > 0) || trial.work < cost.measured_work / 8) return;
    const double work_ns = trial.query_ns / trial.work;
    cost.work_ns = trial.work > 2 * cost.measured_work ? work_ns : std::min(cost.work_ns, work_ns);
    cost.measured_work = std::max(cost.measured_work, trial.work);
}

}  // namespace

bool AutoChoice::is_trial_due() const noexcept {
    return trials < first_trials ||
           share_of_trials * since_trial_ns > boxes.of_next_pose() + learned.of_next_pose();
}

void AutoChoice::take_trial(const Trial& boxes_trial, const Trial& learned_trial) noexcept {
    take(boxes, boxes_trial);
    take(learned, learned_trial);
    expect(boxes_trial.work, learned_trial.work);
    if (boxes_trial.work > 0 && learned_trial.work > 0)
        learned_per_boxes += share() * (learned_trial.work / boxes_trial.work - learned_per_boxes);
    ++trials;
    since_trial_ns = 0;
}

void AutoChoice::expect(double boxes_work, double learned_work) noexcept {
    boxes.work += share() * (boxes_work - boxes.work);
    learned.work += share() * (learned_work - learned.work);
}

void AutoChoice::take_pose(double boxes_work, double learned_work) noexcept {
    if (boxes_work > 0) since_trial_ns += boxes.of_pose(boxes_work);
    if (learned_work > 0) since_trial_ns += learned.of_pose(learned_work);
    expect(boxes_work + learned_work / learned_per_boxes, learned_work + boxes_work * learned_per_boxes);
}

}  // namespace nbd
