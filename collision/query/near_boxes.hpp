#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "collision/geometry/separation.hpp"
#include "collision/kernels/lane_mask.hpp"
#include "collision/tree/leaf_boxes.hpp"

namespace nbd {

/// Tests which boxes are near other boxes: those that overlap them, or those within a distance, metres.
/// Neither test ever leaves out a near box. See Kernels.
class Overlapping {
 public:
    bool boxes(const Box& s, const Box& t) const noexcept { return !apart(s, t, 0); }
    void all(const BoxPack* packs, int count, const Box& t, std::uint16_t* masks) const noexcept {
        kernels_->overlapping(packs, count, numbers(t), masks);
    }
    void each(const BoxPack* packs, int count, const BoxPack* boxes, unsigned which,
              unsigned* masks) const noexcept {
        kernels_->overlapping_each(packs, count, boxes, which, masks);
    }
    unsigned pairs(const BoxPack& s, unsigned in_s, const Box& whole_s, const BoxPack& t, unsigned in_t,
                   const Box& whole_t, std::uint16_t* masks) const noexcept {
        return kernels_->overlapping_pairs(s, in_s, numbers(whole_s), t, in_t, numbers(whole_t), masks);
    }
    void clear_parted(const OrientedBoxes& s, const OrientedBoxes& t, unsigned which,
                      std::uint16_t* masks) const noexcept {
        kernels_->clear_parted(s, t, 0, which, masks);
    }

 private:
    const Kernels* kernels_ = &kernels();
};
class Within {
 public:
    explicit Within(float distance) noexcept : distance_(distance), most_(certain_square(distance)) {}
    bool boxes(const Box& s, const Box& t) const noexcept { return !apart(s, t, distance_); }
    void all(const BoxPack* packs, int count, const Box& t, std::uint16_t* masks) const noexcept {
        kernels_->near(packs, count, numbers(t), most_, masks);
    }
    void each(const BoxPack* packs, int count, const BoxPack* boxes, unsigned which,
              unsigned* masks) const noexcept {
        kernels_->near_each(packs, count, boxes, which, most_, masks);
    }
    unsigned pairs(const BoxPack& s, unsigned in_s, const Box& whole_s, const BoxPack& t, unsigned in_t,
                   const Box& whole_t, std::uint16_t* masks) const noexcept {
        return kernels_->near_pairs(s, in_s, numbers(whole_s), t, in_t, numbers(whole_t), most_, masks);
    }
    void clear_parted(const OrientedBoxes& s, const OrientedBoxes& t, unsigned which,
                      std::uint16_t* masks) const noexcept {
        kernels_->clear_parted(s, t, distance_, which, masks);
    }

 private:
    const Kernels* kernels_ = &kernels();
    float distance_, most_;  // largest distance, largest squared one
};

/// The test for boxes at most this far apart, >= 0, rounded up to float.
inline Within within_at_most(double distance) noexcept {
    constexpr float largest = std::numeric_limits<float>::max();
    return Within(distance >= double{largest} ? largest
                                              : std::nextafter(static_cast<float>(distance), largest));
}

/// Sets bit k if box k of the pack is near t.
template <class Near>
unsigned near_boxes(const BoxPack& pack, const Box& t, const Near& near) noexcept {
    std::uint16_t mask;
    near.all(&pack, 1, t, &mask);
    return mask;
}

/// A bit for each box of a node. The tests below mask out unused lanes: these are far from every box, but not
/// from a NaN position, nor for a distance whose square overflows.
inline unsigned all_boxes(const LeafBoxes::Opened& node) noexcept {
    return node.count == 0 ? 0 : ~0u >> (LeafBoxes::max_boxes - node.count);
}
inline int pack_count(const LeafBoxes::Opened& node) noexcept { return node.count > BoxPack::lanes ? 2 : 1; }

/// Sets bit k if box k of a node is near t.
template <class Near>
unsigned near_boxes(const LeafBoxes::Opened& s, const Box& t, const Near& near) noexcept {
    std::uint16_t masks[2] = {0, 0};
    near.all(s.packs.data(), pack_count(s), t, masks);
    return (masks[0] | static_cast<unsigned>(masks[1]) << BoxPack::lanes) & all_boxes(s);
}

/// For each bit i set in `which`, sets bit k of masks[i] if box k of s is near box i of t.
template <class Near>
void near_boxes(const LeafBoxes::Opened& s, const LeafBoxes::Opened& t, unsigned which, const Near& near,
                unsigned (&masks)[LeafBoxes::max_boxes]) noexcept {
    near.each(s.packs.data(), pack_count(s), t.packs.data(), which, masks);
    for_each_bit(which, [&](int i) { masks[i] &= all_boxes(s); });
}

}  // namespace nbd
