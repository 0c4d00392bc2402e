#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

namespace nbd {

/// What makes a learned bound keep a promise: how much its spheres must grow, and how strange an input may be
/// before the node is bounded exactly. From trajectories that training never saw; calibrate() says precisely
/// what is stated.
struct Calibration {
    double miss_rate = 0;          // in (0, 1): share of a trajectory's nodes, pose by pose, that may miss
    double confidence = 0;         // in (0, 1): share of trajectories that keep to it
    int trajectories = 0;          // that it was made from
    long poses = 0;                // of theirs
    std::vector<float> margins{};  // [nodes] radii are multiplied by 1 + margin, for a GatedBound by
                                   // 1 + margin * margin_weight(ood_score, limit); finite, >= 0. Sides of
                                   // `learned_boxes` move outward by as many spreads instead
    std::vector<float> limits{};   // [nodes] largest ood_score that is in range, finite, >= 0; for a
                                   // GatedBound, others have none
};

/// Throws std::invalid_argument with what is wrong, `bounds` being the name of the bounds, unless the
/// calibration fits a tree of `nodes` nodes: for those that come from a file.
void check_calibration(const Calibration& calibration, std::string_view bounds, std::size_t nodes);

}  // namespace nbd
