#pragma once

#include <array>
#include <cmath>
#include <compare>
#include <cstdint>
#include <functional>
#include <limits>

#include "collision/geometry/face_pair_set.hpp"
#include "collision/geometry/separation.hpp"
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
    long leaf_pairs_proved = 0;   // those of one body with itself whose faces a NeighbourProof left out
    long boxes_refitted = 0;  // nodes of the box trees under the leaves of sphere trees, up to 32 boxes each
    long box_tests = 0;       // pairs of boxes under leaves compared, at most
    long triangle_tests = 0;  // face pairs whose boxes are near
    long face_pairs = 0;      // reported
    long most_pairs = 0;      // pairs of one kind that the query held at a time, see PairQuery::reserve()
};

/// The test for boxes that have a point in common. Like Within it never leaves out a near box, see Kernels.
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

/// The test for boxes within a distance, metres.
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

/// Calls f with the test for boxes within `distance`: Overlapping for 0.
template <class F>
void with_test(float distance, const F& f) {
    if (distance == 0)
        f(Overlapping{});
    else
        f(Within(distance));
}

/// Sets bit k if box k of the pack is near t. near: Overlapping or Within.
template <class Near>
unsigned near_boxes(const BoxPack& pack, const Box& t, const Near& near) noexcept {
    std::uint16_t mask;
    near.all(&pack, 1, t, &mask);
    return mask;
}

/// Bits of the faces of leaf `other` that are proved apart from every face of `leaf`. Must not throw.
using ProvedApart = std::function<unsigned(int leaf, int other)>;

/// How near faces of two leaves must come to count as near, metres, >= 0 and at most the distance of the
/// walk. Must not throw.
using LeafReach = std::function<float(int leaf_a, int leaf_b)>;

/// What a walk over one body with itself leaves out, besides faces that share a vertex. Null: nothing.
struct LeftOut {
    const FacePairSet* pairs = nullptr;
    const ProvedApart* proved = nullptr;  // of the leaves of a wide tree
    const LeafReach* reach = nullptr;     // likewise; null: the walk's distance everywhere
};

/// Which pairs a walk over two bodies takes: all.
struct TwoBodies {
    static constexpr bool is_one_body = false;
    static bool children(int, int, int, int) noexcept { return true; }
    static bool faces(int, int) noexcept { return true; }
    static unsigned proved_apart(int, int) noexcept { return 0; }
};

/// Which pairs a walk over one body with itself takes: every pair of parts once, and no faces that share a
/// vertex or are among those left out. Posed: what numbers the body's faces by slots, with face() and
/// face_vertices().
template <class Posed>
class OneBody {
 public:
    static constexpr bool is_one_body = true;

    OneBody(const Posed& body, const LeftOut& left_out) noexcept : body_(body), left_out_(left_out) {}

    /// Whether to take children i and j of nodes a and b.
    static bool children(int a, int b, int i, int j) noexcept { return a != b || i <= j; }
    /// Whether to take the faces in two slots. A face shares vertices with itself.
    bool faces(int slot_a, int slot_b) const noexcept {
        const std::array<int, 3> s = body_.face_vertices(slot_a), t = body_.face_vertices(slot_b);
        for (const int v : s)
            if (v == t[0] || v == t[1] || v == t[2]) return false;
        return !(left_out_.pairs && left_out_.pairs->contains(body_.face(slot_a), body_.face(slot_b)));
    }
    /// Bits of faces of leaf b that are proved apart from all of leaf a.
    unsigned proved_apart(int leaf_a, int leaf_b) const noexcept {
        return left_out_.proved ? (*left_out_.proved)(leaf_a, leaf_b) : 0;
    }

 private:
    const Posed& body_;
    LeftOut left_out_;
};

}  // namespace nbd
