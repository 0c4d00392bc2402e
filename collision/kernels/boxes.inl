// Tests of boxes against boxes, part of kernels.inl.

struct BoxLanes {
    Lanes lo[3], hi[3];
};
inline BoxLanes same_box(const float* box) noexcept {
    return {{all(box[0]), all(box[1]), all(box[2])}, {all(box[4]), all(box[5]), all(box[6])}};
}
inline BoxLanes same_box(const BoxPack* boxes, int i) noexcept {
    const BoxPack& pack = boxes[i / 16];
    const int k = i % 16;
    return {{all(pack.lo[0][k]), all(pack.lo[1][k]), all(pack.lo[2][k])},
            {all(pack.hi[0][k]), all(pack.hi[1][k]), all(pack.hi[2][k])}};
}

/// The larger of the gaps on the two sides of an axis; negative if the boxes overlap on it.
inline Lanes gap(const BoxPack& boxes, const BoxLanes& box, int axis) noexcept {
    return max(load(boxes.lo[axis]) - box.hi[axis], box.lo[axis] - load(boxes.hi[axis]));
}

struct Overlap {
    unsigned operator()(const BoxPack& pack, const BoxLanes& box) const noexcept {
        // Gaps are differences of float32 numbers, whose sign is exact.
        return not_above(max(max(gap(pack, box, 0), gap(pack, box, 1)), gap(pack, box, 2)), 0);
    }
};
struct Near {
    float most;
    unsigned operator()(const BoxPack& pack, const BoxLanes& box) const noexcept {
        Lanes squared = all(0);
        for (int axis = 0; axis < 3; ++axis) {
            const Lanes distance = max(all(0), gap(pack, box, axis));
            squared = squared + distance * distance;
        }
        return not_above(squared, most);
    }
};

template <class Test>
inline void test_all(const Test& test, const BoxPack* packs, int count, const float* box,
                     std::uint16_t* masks) noexcept {
    const BoxLanes lanes = same_box(box);
    for (int p = 0; p < count; ++p) masks[p] = static_cast<std::uint16_t>(test(packs[p], lanes));
}
template <class Test>
inline void test_each(const Test& test, const BoxPack* packs, int count, const BoxPack* boxes, unsigned which,
                      unsigned* masks) noexcept {
    for (; which != 0; which &= which - 1) {
        const int i = __builtin_ctz(which);
        const BoxLanes lanes = same_box(boxes, i);
        masks[i] = test(packs[0], lanes);
        if (count > 1) masks[i] |= test(packs[1], lanes) << 16;
    }
}

/// Returns f(test) with the test for gaps whose square is at most `most`.
template <class F>
inline auto with_test(float most, const F& f) noexcept {
    return most == 0 ? f(Overlap{}) : f(Near{most});
}

void near(const BoxPack* packs, int count, const float* box, float most, std::uint16_t* masks) noexcept {
    with_test(most, [&](const auto& test) { test_all(test, packs, count, box, masks); });
}
void near_each(const BoxPack* packs, int count, const BoxPack* boxes, unsigned which, float most,
               unsigned* masks) noexcept {
    with_test(most, [&](const auto& test) { test_each(test, packs, count, boxes, which, masks); });
}

template <class Test>
inline unsigned test_pairs(const Test& test, const BoxPack& s, unsigned in_s, const float* whole_s,
                           const BoxPack& t, unsigned in_t, const float* whole_t,
                           std::uint16_t* masks) noexcept {
    const unsigned near_s = test(s, same_box(whole_t)) & in_s;
    if (near_s == 0) return 0;
    const unsigned near_t = test(t, same_box(whole_s)) & in_t;
    if (near_t == 0) return 0;
    for (unsigned left = near_s; left != 0; left &= left - 1) {
        const int i = __builtin_ctz(left);
        masks[i] = static_cast<std::uint16_t>(test(t, same_box(&s, i)) & near_t);
    }
    return near_s;
}
unsigned near_pairs(const BoxPack& s, unsigned in_s, const float* whole_s, const BoxPack& t, unsigned in_t,
                    const float* whole_t, float most, std::uint16_t* masks) noexcept {
    return with_test(
        most, [&](const auto& test) { return test_pairs(test, s, in_s, whole_s, t, in_t, whole_t, masks); });
}
