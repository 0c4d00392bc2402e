#include "collision/bounds/learned/auto_boxes.hpp"

namespace nbd {

static_assert(BoxBound<AutoBoxes>);

AutoBoxes::AutoBoxes(const SphereTree& tree, const LearnedModel* model, const NodeMargins& margins)
    : tree_(&tree), exact_(tree), asked_(tree.nodes.size(), 0) {
    if (!model || model->boxes.empty()) return;
    learned_boxes_.emplace(tree, *model, margins);
    samples_ = static_cast<double>(model->samples.size()) / static_cast<double>(model->nodes.size());
}

bool AutoBoxes::learned_is_cheaper(bool on_demand) const noexcept {
    if (!learned_boxes_) return false;
    // Costs in ns: a vertex in a pass over all of them, a vertex as a sample, a learned node without its
    // samples, and the weights of a position that is computed on demand. A learned node costs as much as
    // about 90 vertices with two bodies in the cache (`nbdtree-bench peers`), and as 170 in a crowd that
    // exceeds the cache (`nbdtree-bench scaling`). These values make it 145, which keeps `auto` near the
    // better choice in both.
    constexpr double vertex = 2.3, sample = 17, node = 60, weights = 15;
    const double own = on_demand ? weights : 0.;
    const double exact = static_cast<double>(tree_->vertices.size()) * (vertex + own);
    const double learned = bounded() * (node + samples_ * (sample + own));
    return learned < exact;
}

void AutoBoxes::begin_pose(const Positions& x) noexcept {
    learned_ = learned_is_cheaper(x.on_demand());
    ++pose_;
    bounded_ = 0;
    if (learned_) {
        learned_boxes_->begin_pose(x);
    } else {
        x.require_all();
        exact_.begin_pose(x);
    }
}

}  // namespace nbd
