#include "meshing/tets/nearest_vertex.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace nbd {

NearestVertex::NearestVertex(NodesRef points) : points_(points), order_(points.rows()), axis_(order_.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    sort(0, order_.size());
}

void NearestVertex::sort(int begin, int end) noexcept {
    if (begin >= end) return;
    Eigen::RowVector3d low = points_.row(order_[begin]), high = low;
    for (int i = begin + 1; i < end; ++i) {
        low = low.cwiseMin(points_.row(order_[i]));
        high = high.cwiseMax(points_.row(order_[i]));
    }
    int axis = 0;
    (high - low).maxCoeff(&axis);
    const int middle = begin + (end - begin) / 2;
    // Ties are broken by row, so the tree does not depend on the library's selection algorithm.
    std::nth_element(
        order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](int a, int b) {
            return points_(a, axis) != points_(b, axis) ? points_(a, axis) < points_(b, axis) : a < b;
        });
    axis_[middle] = static_cast<unsigned char>(axis);
    sort(begin, middle);
    sort(middle + 1, end);
}

void NearestVertex::search(int begin, int end, const Eigen::Vector3d& p, Hit& best) const noexcept {
    if (begin >= end) return;
    const int middle = begin + (end - begin) / 2;
    const int vertex = order_[middle];
    const double distance = (points_.row(vertex).transpose() - p).norm();
    if (distance < best.distance) best = {vertex, distance};
    const double offset = p[axis_[middle]] - points_(vertex, axis_[middle]);
    const bool left_first = offset < 0;
    search(left_first ? begin : middle + 1, left_first ? middle : end, p, best);
    if (std::abs(offset) < best.distance)
        search(left_first ? middle + 1 : begin, left_first ? end : middle, p, best);
}

NearestVertex::Hit NearestVertex::find(const Eigen::Vector3d& p) const noexcept {
    Hit best{-1, std::numeric_limits<double>::infinity()};
    search(0, order_.size(), p, best);
    return best;
}

}  // namespace nbd
