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
    // What a vertex costs among all of them, in a node's samples, and a learned node beside its samples, in
    // ns; a position that is computed on demand costs its weights. A learned node costs as much as some 90
    // vertices with two bodies in the cache (`nbdtree bench peers`), as 170 in a crowd that is not in it
    // (`nbdtree bench scaling`): these are 145, with which `auto` is near the better choice in both.
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
