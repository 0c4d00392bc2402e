#pragma once

#include "collision/leaf_boxes.hpp"
#include "collision/separation.hpp"

namespace nbd {

/// Which boxes of a pack are near another box: those that overlap it, or come within a distance, metres.
/// Never leaves one out in error.
struct Overlapping {
    unsigned operator()(const BoxPack& s, const Box& t) const noexcept { return overlapping(s, t); }
};
class Within {
 public:
    explicit Within(float distance) noexcept : most_(certain_square(distance)) {}
    unsigned operator()(const BoxPack& s, const Box& t) const noexcept { return near(s, t, most_); }

 private:
    float most_;  // squared
};

/// Bit k is set where box k of a node is near t. Lanes without a box are left out: they are far from every
/// box, but not from a position that is no number, nor over a distance whose square overflows.
template <class Near>
unsigned near_boxes(const LeafBoxes::Opened& s, const Box& t, const Near& near) noexcept {
    if (s.count == 0) return 0;
    unsigned mask = near(s.packs[0], t);
    if (s.count > BoxPack::lanes) mask |= near(s.packs[1], t) << BoxPack::lanes;
    return mask & ~0u >> (LeafBoxes::most_boxes - s.count);
}

}  // namespace nbd
