#include "collision/bounds/certified/path_forest.hpp"

#include <algorithm>
#include <functional>

namespace nbd {

PathForest::PathForest(const SolidGraph& graph)
    : graph_(&graph), points_(static_cast<std::size_t>(graph.point_count())) {}

void PathForest::clear() {
    for (const int p : touched_) points_[static_cast<std::size_t>(p)] = {};
    touched_.clear();
}

void PathForest::grow(int root, double limit, const std::vector<char>& is_wanted, int wanted) {
    heap_.clear();
    const auto reach = [&](int point, double distance, int from, const SolidGraph::Link& link) {
        Point& p = points_[static_cast<std::size_t>(point)];
        if (!(distance < p.distance) || distance > limit) return;
        if (p.distance == unreached) touched_.push_back(point);
        p = {distance, from, link};
        heap_.emplace_back(distance, point);
        std::ranges::push_heap(heap_, std::greater{});
    };
    reach(root, 0, -1, {});
    while (!heap_.empty()) {
        std::ranges::pop_heap(heap_, std::greater{});
        const auto [distance, point] = heap_.back();
        heap_.pop_back();
        if (distance > points_[static_cast<std::size_t>(point)].distance) continue;
        if (wanted > 0 && is_wanted[static_cast<std::size_t>(point)] && --wanted == 0) return;
        for (const SolidGraph::Link& link : graph_->links(point))
            reach(link.to, distance + link.length, point, link);
    }
}

}  // namespace nbd
