#include "collision/query/sweep.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace nbd {
namespace {

bool is_empty(const Box& box) { return (box.lo > box.hi).any(); }

int widest_axis(std::span<const Box> boxes) {
    Eigen::Array3f lowest = Eigen::Array3f::Constant(std::numeric_limits<float>::infinity());
    Eigen::Array3f highest = -lowest;
    for (const Box& box : boxes) {
        if (is_empty(box)) continue;
        const Eigen::Array3f centre = (box.lo.head<3>() + box.hi.head<3>()) / 2;
        lowest = lowest.min(centre);
        highest = highest.max(centre);
    }
    int axis = 0;
    (highest - lowest).maxCoeff(&axis);
    return axis;
}

}  // namespace

std::span<const BodyIndices> Sweep::touching(std::span<const Box> boxes) {
    const int axis = widest_axis(boxes);
    const auto box = [&](int i) -> const Box& { return boxes[i]; };
    order_.resize(boxes.size());
    std::iota(order_.begin(), order_.end(), 0);
    std::erase_if(order_, [&](int i) { return is_empty(box(i)); });
    std::ranges::sort(order_, {}, [&](int i) { return std::pair(box(i).lo[axis], i); });
    pairs_.clear();
    for (std::size_t i = 0; i < order_.size(); ++i)
        for (std::size_t j = i + 1; j < order_.size() && box(order_[j]).lo[axis] <= box(order_[i]).hi[axis];
             ++j)
            if ((box(order_[i]).lo <= box(order_[j]).hi).all() &&
                (box(order_[j]).lo <= box(order_[i]).hi).all())
                pairs_.push_back({std::min(order_[i], order_[j]), std::max(order_[i], order_[j])});
    std::ranges::sort(pairs_);
    return pairs_;
}

}  // namespace nbd
