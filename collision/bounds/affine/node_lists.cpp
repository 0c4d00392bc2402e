#include "collision/bounds/affine/node_lists.hpp"

#include "collision/kernels/box_pack.hpp"

namespace nbd {

NodeLists::NodeLists(std::span<const std::span<const std::int32_t>> lists, int node_count)
    : last_(3 * (node_count - 1)) {
    for (const auto& list : lists) {
        const std::size_t begin = places_.size();
        for (const std::int32_t place : list)
            if (place == last_)
                at_end_.push_back(counts_.size());
            else
                places_.push_back(place);
        while ((places_.size() - begin) % 4 != 0) places_.push_back(places_.back());
        counts_.push_back(static_cast<std::int32_t>(places_.size() - begin));
    }
}

bool NodeLists::boxes(const float* x, std::span<Box> boxes) const noexcept {
    bool finite =
        kernels().boxes_of_lists(x, places_.data(), counts_.data(), counts_.size(), numbers(boxes.front()));
    const float* p = x + last_;
    for (const int list : at_end_) {
        const Eigen::Array4f point(p[0], p[1], p[2], 0);
        finite &= (0 * point == 0).all();
        Box& box = boxes[list];
        box = joined(box, {point, point});
    }
    return finite;
}

std::size_t NodeLists::bytes() const noexcept {
    return (places_.size() + counts_.size()) * sizeof(places_[0]) + at_end_.size() * sizeof(at_end_[0]);
}

}  // namespace nbd
