#pragma once

#include <limits>
#include <vector>

#include "collision/bounds/certified/solid_graph.hpp"

namespace nbd {

/// Shortest paths from a growing set of roots to the points near them [Dijkstra59]: each point belongs to
/// the root from which it is reached by the shortest path so far.
class PathForest {
 public:
    static constexpr double unreached = std::numeric_limits<double>::infinity();

    /// graph: referred to.
    explicit PathForest(const SolidGraph& graph);

    /// Forgets all roots.
    void clear();

    /// Adds a root and takes over the points that it is nearer to, as far as `limit` metres. wanted: the
    /// search may end once it has settled so many of the points that `is_wanted` marks; 0: it does not.
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
