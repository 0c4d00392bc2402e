#pragma once

#include <vector>

namespace nbd {

/// How the volumes of a bound are used, node by node.
struct NodeMargins {
    std::vector<float> margins;  // [nodes] what they grow by, see Calibration
    std::vector<float> limits;   // [nodes] of ood_score, above which a node is bounded exactly, and margins
                                 // grow with it; none: neither
};

}  // namespace nbd
