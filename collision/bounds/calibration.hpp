#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

namespace nbd {

/// Calibrates a learned bound to a stated miss rate: how much its volumes must grow, and the
/// out-of-distribution score above which a node is bounded exactly. Measured on held-out trajectories;
/// calibrate() defines exactly what is guaranteed.
struct Calibration {
    double miss_rate = 0;   // in (0, 1): share of a trajectory's nodes, pose by pose, that may miss
    double confidence = 0;  // in (0, 1): share of trajectories that stay within the miss rate
    int trajectories = 0;   // number of calibration trajectories
    long poses = 0;         // number of poses in these trajectories
    /// [nodes], finite, >= 0. Radii are multiplied by 1 + margin, for a GatedBound by
    /// 1 + margin * margin_weight(ood_score, limit). Sides of `learned_affine` move outward by
    /// margin * margin_weight(ood_score, limit) spreads or residuals instead; their "nodes" are
    /// LearnedAffineModel::bounds().
    std::vector<float> margins{};
    /// [nodes] largest ood_score in range, finite, >= 0; empty for bounds without a score.
    std::vector<float> limits{};
};

/// Margins and score limits of all nodes for one bound.
struct NodeMargins {
    std::vector<float> margins;  // [nodes] growth of the volumes, see Calibration
    std::vector<float> limits;   // [nodes] ood_score above which a node is bounded exactly; below it, margins
                                 // grow with the score. Empty: no limits, constant margins
};

/// Factor of a calibrated margin: 0.03 at score 0, rising to 1 at the limit; always 1 if the limit is 0.
inline float margin_weight(float ood_score, float limit) noexcept {
    return limit > 0 ? 0.03f + 0.97f * ood_score / limit : 1;
}

/// Validates a calibration read from a file. Throws std::invalid_argument, saying what is wrong, unless it
/// fits a tree of `nodes` nodes. bounds: name of the bounds, for the message.
void check_calibration(const Calibration& calibration, std::string_view bounds, std::size_t nodes);

}  // namespace nbd
