#pragma once

#include <limits>
#include <vector>

#include "collision/bounds/certified/solid_graph.hpp"

namespace nbd {

/// Shortest paths from a growing set of roots to the points near them [Dijkstra59]. Each point belongs to the
/// root with the shortest path to it so far.
class PathForest {
 public:
    static constexpr double unreached = std::numeric_limits<double>::infinity();

    /// graph: must outlive this object.
    explicit PathForest(const SolidGraph& graph);

    /// Removes all roots.
    void clear();

    /// Adds a root and assigns to it all points within `limit` metres that no other root is nearer to.
    /// wanted: the search may end after settling this many of the points marked in `is_wanted`; 0: it does
    /// not end early.
    void grow(int root, double limit, const std::vector<char>& is_wanted, int wanted);

    double distance(int point) const noexcept { return points_[static_cast<std::size_t>(point)].distance; }

    /// Walks from a point to its root, calling visit(link) for every link of the path; returns the root.
    template <class Visit>
    int walk(int point, const Visit& visit) const {
        for (;;) {
            const Point& at = points_[static_cast<std::size_t>(point)];
            if (at.from < 0) return point;
            visit(at.link);
            point = at.from;
        }
    }

 private:
    struct Point {
        double distance = unreached;
        int from = -1;
        SolidGraph::Link link{};
    };
    const SolidGraph* graph_;
    std::vector<Point> points_;
    std::vector<int> touched_;
    std::vector<std::pair<double, int>> heap_;
};

}  // namespace nbd
