#pragma once

#include <functional>
#include <span>
#include <vector>

#include "apps/bench/threads/thread_table.hpp"
#include "sim/scene/scene.hpp"

namespace nbd {

struct SceneWorkConfig {
    int skip = 1;     // steps before the counted ones, at least 1: the first makes what later ones keep
    int steps = 10;   // counted
    int repeats = 2;  // worlds in which the same steps are recorded: a part's time is the shortest of all
};

/// Counts the work of steps of a scene, and measures them on as many threads as threads_here() tells, in
/// worlds of their own that take the same steps in turns. progress(done, total): called after steps. Throws
/// std::runtime_error where a step fails or two worlds do not end with the same bits.
std::vector<MeasuredTimes> count_scene(const SceneSpec& spec, std::span<const LoadedBody> bodies,
                                       const SceneWorkConfig& config,
                                       const std::function<void(int, int)>& progress, WorkCount& count);

}  // namespace nbd
