#include "sim/sweep.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

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

std::vector<BodyIndices> touching_boxes(std::span<const Box> boxes) {
    const int axis = widest_axis(boxes);
    const auto box = [&](int i) -> const Box& { return boxes[static_cast<std::size_t>(i)]; };
    std::vector<int> order(boxes.size());
    std::iota(order.begin(), order.end(), 0);
    std::erase_if(order, [&](int i) { return is_empty(box(i)); });
    std::ranges::stable_sort(order, {}, [&](int i) { return box(i).lo[axis]; });
    std::vector<BodyIndices> pairs;
    for (std::size_t i = 0; i < order.size(); ++i)
        for (std::size_t j = i + 1; j < order.size() && box(order[j]).lo[axis] <= box(order[i]).hi[axis]; ++j)
            if ((box(order[i]).lo <= box(order[j]).hi).all() && (box(order[j]).lo <= box(order[i]).hi).all())
                pairs.push_back({std::min(order[i], order[j]), std::max(order[i], order[j])});
    std::ranges::sort(pairs);
    return pairs;
}

}  // namespace nbd
