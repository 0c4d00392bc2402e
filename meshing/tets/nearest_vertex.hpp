#pragma once

#include <Eigen/Core>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Finds the nearest of a fixed set of points by a balanced k-d tree. Queries are const and thread-safe.
class NearestVertex {
 public:
    struct Hit {
        int vertex = -1;  // row of the points
        double distance = 0;
    };

    /// points: at least one row, finite; copied.
    explicit NearestVertex(NodesRef points);

    /// The nearest point to `p`. Ties are resolved in a fixed way.
    Hit find(const Eigen::Vector3d& p) const noexcept;

 private:
    void sort(int begin, int end) noexcept;
    void search(int begin, int end, const Eigen::Vector3d& p, Hit& best) const noexcept;

    Nodes points_;
    std::vector<int> order_;           // the median of a range is the node, its halves are the children
    std::vector<unsigned char> axis_;  // splitting axis, per position in order_
};

}  // namespace nbd
