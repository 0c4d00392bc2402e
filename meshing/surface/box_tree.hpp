#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <utility>
#include <vector>

namespace nbd {

/// A static tree of axis-aligned boxes over numbered items, for searches in rest poses (checks, embeddings).
/// Double precision, built once.
class BoxTree {
 public:
    using Box = Eigen::AlignedBox3d;

    /// boxes: one per item, none empty.
    explicit BoxTree(std::vector<Box> boxes);

    /// Calls visit(item) for every item whose box overlaps or touches `box`.
    template <class Visit>
    void overlapping(const Box& box, Visit&& visit) const {
        if (!nodes_.empty()) overlapping(0, box, visit);
    }

    /// Returns the item with the smallest distance(item) and that value, a squared distance; ties go to the
    /// item found first. distance(item) must be at least the squared distance of `point` to the item's box.
    /// Returns {-1, infinity} for an empty tree.
    template <class Distance>
    std::pair<int, double> nearest(const Eigen::Vector3d& point, Distance&& distance) const {
        std::pair<int, double> best = {-1, std::numeric_limits<double>::infinity()};
        if (!nodes_.empty()) nearest(0, point, distance, best);
        return best;
    }

 private:
    static constexpr int leaf_items = 4;
    struct Node {
        Box box;
        int first_child = -1;    // children are first_child and first_child + 1; -1 marks a leaf
        int begin = 0, end = 0;  // range of items_
    };

    void split(int node);

    template <class Visit>
    void overlapping(int n, const Box& box, Visit& visit) const {
        const Node& node = nodes_[n];
        if (!node.box.intersects(box)) return;
        if (node.first_child >= 0) {
            overlapping(node.first_child, box, visit);
            overlapping(node.first_child + 1, box, visit);
            return;
        }
        for (int i = node.begin; i < node.end; ++i) {
            const int item = items_[i];
            if (boxes_[item].intersects(box)) visit(item);
        }
    }

    template <class Distance>
    void nearest(int n, const Eigen::Vector3d& point, Distance& distance,
                 std::pair<int, double>& best) const {
        const Node& node = nodes_[n];
        if (node.first_child < 0) {
            for (int i = node.begin; i < node.end; ++i) {
                const int item = items_[i];
                if (boxes_[item].squaredExteriorDistance(point) >= best.second) continue;
                if (const double d = distance(item); d < best.second) best = {item, d};
            }
            return;
        }
        int near = node.first_child, far = near + 1;
        const auto gap = [&](int child) { return nodes_[child].box.squaredExteriorDistance(point); };
        double near_gap = gap(near), far_gap = gap(far);
        if (far_gap < near_gap) std::swap(near, far), std::swap(near_gap, far_gap);
        if (near_gap < best.second) nearest(near, point, distance, best);
        if (far_gap < best.second) nearest(far, point, distance, best);
    }

    std::vector<Box> boxes_;
    std::vector<int> items_;  // each node owns a contiguous range
    std::vector<Node> nodes_;
};

}  // namespace nbd
