// Slabs of oriented boxes, part of kernels.inl.

/// The slab of boxes across directions n. A coordinate along n is a sum of products whose rounding errors, at
/// most 8 u sum over axes of |n| (|centre| + |sides| + margin), are below 17 u M of slack(), per axis.
struct Slab {
    Lanes lo, hi;

    /// number(p): loads one field of the boxes into lanes.
    template <class Number>
    Slab(const OrientedBoxes& boxes, const Lanes (&n)[3], const Number& number) noexcept {
        const auto along = [&](const float(&v)[3][16]) {
            return number(v[0]) * n[0] + number(v[1]) * n[1] + number(v[2]) * n[2];
        };
        const Lanes centre = along(boxes.centre);
        const Lanes half = abs(along(boxes.side[0])) + abs(along(boxes.side[1])) + abs(along(boxes.side[2])) +
                           (number(boxes.margin[0]) * abs(n[0]) + number(boxes.margin[1]) * abs(n[1]) +
                            number(boxes.margin[2]) * abs(n[2]));
        lo = centre - half;
        hi = centre + half;
    }
};

/// How far apart two slabs of one direction are; negative if they overlap, NaN if a number overflowed.
inline Lanes gap(const Lanes& lo, const Lanes& hi, const Slab& other) noexcept {
    const Lanes gap = max(lo - other.hi, other.lo - hi);
    return gap + all(0) * ((lo - other.hi) + (other.lo - hi));
}

/// Sets the normals of boxes and their slabs.
inline void find_slabs(OrientedBoxes& boxes) noexcept {
    Lanes n[3];
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        n[a] =
            load(boxes.side[0][b]) * load(boxes.side[1][c]) - load(boxes.side[0][c]) * load(boxes.side[1][b]);
    }
    // The number added keeps normals that are tiny from becoming longer than 1 where their squares underflow.
    const Lanes length = root(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] + all(0x1p-100f));
    for (int a = 0; a < 3; ++a) {
        n[a] = n[a] / length;
        store(n[a], boxes.normal[a]);
    }
    const Slab slab(boxes, n, [](const float* p) { return load(p); });
    store(slab.lo, boxes.lo);
    store(slab.hi, boxes.hi);
}

void clear_parted(const OrientedBoxes& s, const OrientedBoxes& t, float distance, unsigned which,
                  std::uint16_t* masks) noexcept {
    // A normal is longer than 1 by a few u at most. 2^-100 covers underflow of coordinates along it.
    const float limit = distance * (1 + 0x1p-16f) + 0x1p-100f;
    const Lanes of_t[3] = {load(t.normal[0]), load(t.normal[1]), load(t.normal[2])};
    for (; which != 0; which &= which - 1) {
        const int i = __builtin_ctz(which);
        if (masks[i] == 0) continue;
        const Lanes of_s[3] = {all(s.normal[0][i]), all(s.normal[1][i]), all(s.normal[2][i])};
        const Slab across_s(t, of_s, [](const float*p) { return load(p); }),
            across_t(s, of_t, [i](const float*p) { return all(p[i]); });
        const unsigned parted = above(gap(all(s.lo[i]), all(s.hi[i]), across_s), limit) |
                                above(gap(load(t.lo), load(t.hi), across_t), limit);
        masks[i] &= static_cast<std::uint16_t>(~parted);
    }
}
