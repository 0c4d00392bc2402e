#pragma once

#include <vector>

namespace nbd {

/// Margins and score limits of all nodes for one bound.
struct NodeMargins {
    std::vector<float> margins;  // [nodes] growth of the volumes, see Calibration
    std::vector<float> limits;   // [nodes] ood_score above which a node is bounded exactly; below it, margins
                                 // grow with the score. Empty: no limits, constant margins
};

}  // namespace nbd
