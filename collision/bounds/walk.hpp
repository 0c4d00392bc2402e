#pragma once

#include <cmath>
#include <compare>
#include <cstdint>
#include <limits>

#include "collision/geometry/box.hpp"
#include "collision/kernels/box_pack.hpp"
#include "collision/kernels/kernels.hpp"

// What the walks over both kinds of trees have in common.
namespace nbd {

/// Two nodes, one of each tree: numbers of nodes of sphere trees, or of one level of wide trees.
struct NodePair {
    int a = 0, b = 0;
    auto operator<=>(const NodePair&) const = default;
};
using LeafPair = NodePair;

/// Counters of one query.
struct QueryCounters {
    long nodes_bounded = 0;       // nodes bounded by this query, in both trees
    long nodes_out_of_range = 0;  // those bounded exactly because their input was out of the calibrated range
    long node_tests = 0;          // pairs of tree nodes compared, at most
    long leaf_pairs = 0;          // leaf pairs whose bounds overlap
    long boxes_refitted = 0;  // nodes of the box trees under the leaves of sphere trees, up to 32 boxes each
    long box_tests = 0;       // pairs of boxes under leaves compared, at most
    long triangle_tests = 0;  // face pairs whose boxes are near
    long face_pairs = 0;      // reported
    long most_pairs = 0;      // pairs of one kind that the query held at a time, see PairQuery::reserve()
};

/// The test for boxes within a distance, metres; for 0, boxes that have a point in common. It never leaves
/// out a near box, see Kernels.
class Within {
 public:
    explicit Within(float distance) noexcept
        : distance_(distance), most_(distance == 0 ? 0 : certain_square(distance)) {}
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
inline unsigned near_boxes(const BoxPack& pack, const Box& t, const Within& near) noexcept {
    std::uint16_t mask;
    near.all(&pack, 1, t, &mask);
    return mask;
}

}  // namespace nbd
