#pragma once

#include "collision/bounds/affine/affine_boxes.hpp"

namespace nbd {

/// The clusters, whose children are blocks, and the blocks, whose children are leaves.
struct ClusterLevel {
    static Box box(const AffineBoxes& body, int i) noexcept { return body.cluster(i); }
    static const AffineBoxes::Children& children(AffineBoxes& body, int i) { return body.blocks(i); }
    static unsigned present(const AffineBoxes& body, int i) noexcept { return body.present_blocks(i); }
    static int first_child(const AffineBoxes& body, int i) noexcept { return body.first_block(i); }
    static void prefetch(const AffineBoxes& body, int i) noexcept { body.prefetch_cluster(i); }
};
struct BlockLevel {
    static Box box(const AffineBoxes& body, int i) noexcept { return body.block(i); }
    static const AffineBoxes::Children& children(AffineBoxes& body, int i) { return body.leaves(i); }
    static unsigned present(const AffineBoxes& body, int i) noexcept { return body.present_leaves(i); }
    static int first_child(const AffineBoxes&, int i) noexcept { return tree_width * i; }
    static void prefetch(const AffineBoxes& body, int i) noexcept { body.prefetch_block(i); }
};

}  // namespace nbd
