#pragma once

#include <vector>

#include "collision/bounds/affine/wide_tree.hpp"
#include "collision/geometry/box.hpp"

namespace nbd {

/// The exact boxes of a wide tree's nodes in a pose, from all vertices: what other bounds are measured
/// against.
struct WideBoxes {
    std::vector<Box> clusters, blocks, leaves;  // leaves that are not present have the empty box
};

/// x: [vertex_count, 3].
void fit_wide_boxes(const WideTree& tree, VerticesRef x, WideBoxes& boxes);

}  // namespace nbd
