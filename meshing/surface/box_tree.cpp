#include "meshing/surface/box_tree.hpp"

#include <algorithm>
#include <numeric>

namespace nbd {

BoxTree::BoxTree(std::vector<Box> boxes) : boxes_(std::move(boxes)), items_(boxes_.size()) {
    std::iota(items_.begin(), items_.end(), 0);
    if (items_.empty()) return;
    nodes_.reserve(boxes_.size());
    nodes_.push_back({Box(), -1, 0, static_cast<int>(items_.size())});
    split(0);
}

/// Splits a node at the median of the box centres along their longest extent.
void BoxTree::split(int n) {
    const std::size_t node = n;
    Box centres;
    for (int i = nodes_[node].begin; i < nodes_[node].end; ++i) {
        const Box& box = boxes_[items_[i]];
        nodes_[node].box.extend(box);
        centres.extend(box.center());
    }
    const int begin = nodes_[node].begin, end = nodes_[node].end, middle = begin + (end - begin) / 2;
    if (end - begin <= leaf_items) return;
    int axis = 0;
    centres.sizes().maxCoeff(&axis);
    std::nth_element(
        items_.begin() + begin, items_.begin() + middle, items_.begin() + end, [&](int a, int b) {
            return std::pair(boxes_[a].center()[axis], a) < std::pair(boxes_[b].center()[axis], b);
        });
    const int first_child = nodes_.size();
    nodes_[node].first_child = first_child;
    nodes_.push_back({Box(), -1, begin, middle});
    nodes_.push_back({Box(), -1, middle, end});
    split(first_child);
    split(first_child + 1);
}

}  // namespace nbd
