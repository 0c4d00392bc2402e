// The kernels, written in terms of lanes. Each kernels_*.cpp compiles them for its instruction set.

constexpr float infinity = __builtin_inff();

// Boxes

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

void overlapping(const BoxPack* packs, int count, const float* box, std::uint16_t* masks) noexcept {
    test_all(Overlap{}, packs, count, box, masks);
}
void near(const BoxPack* packs, int count, const float* box, float most, std::uint16_t* masks) noexcept {
    test_all(Near{most}, packs, count, box, masks);
}
void overlapping_each(const BoxPack* packs, int count, const BoxPack* boxes, unsigned which,
                      unsigned* masks) noexcept {
    test_each(Overlap{}, packs, count, boxes, which, masks);
}
void near_each(const BoxPack* packs, int count, const BoxPack* boxes, unsigned which, float most,
               unsigned* masks) noexcept {
    test_each(Near{most}, packs, count, boxes, which, masks);
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
unsigned overlapping_pairs(const BoxPack& s, unsigned in_s, const float* whole_s, const BoxPack& t,
                           unsigned in_t, const float* whole_t, std::uint16_t* masks) noexcept {
    return test_pairs(Overlap{}, s, in_s, whole_s, t, in_t, whole_t, masks);
}
unsigned near_pairs(const BoxPack& s, unsigned in_s, const float* whole_s, const BoxPack& t, unsigned in_t,
                    const float* whole_t, float most, std::uint16_t* masks) noexcept {
    return test_pairs(Near{most}, s, in_s, whole_s, t, in_t, whole_t, masks);
}

#include "collision/kernels/points.inl"

// Triangles

void pack_triangles(const float* const (*corners)[16], TrianglePack& pack) noexcept {
    for (int c = 0; c < 3; ++c) {
        Lanes x[3];
        load_points([&](int k) { return corners[c][k]; }, x);
        for (int axis = 0; axis < 3; ++axis) store(x[axis], pack.corners[c][axis]);
    }
}

struct Corner {
    Lanes x, y, z;
};
inline Corner operator-(const Corner& a, const Corner& b) noexcept {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Lanes dot(const Corner& a, const Corner& b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Corner abs(const Corner& a) noexcept { return {abs(a.x), abs(a.y), abs(a.z)}; }

struct Corners {
    Corner at[3];
    explicit Corners(const TrianglePack& pack) noexcept {
        for (int k = 0; k < 3; ++k)
            at[k] = {load(pack.corners[k][0]), load(pack.corners[k][1]), load(pack.corners[k][2])};
    }
};

/// Certainty of a sign: it is certainly positive where `positive` > 0, and certainly negative where
/// `negative` > 0. `doubt` is NaN where something overflowed and 0 elsewhere; minima and maxima of the other
/// two may lose NaN.
struct Sign {
    Lanes positive, negative, doubt;
};

/// Signs of det[u, v, w] for float32 differences u and v and any w.
class Determinant {
 public:
    Determinant(const Corner& u, const Corner& v) noexcept {
        const Corner p = abs(u), q = abs(v);
        normal_ = {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
        size_ = {p.y * q.z + p.z * q.y, p.z * q.x + p.x * q.z, p.x * q.y + p.y * q.x};
    }

    /// The error bound is that of PlaneSide, in float32: 9 half ulps of the permanent. Products may
    /// underflow: those of the normal by at most 3 * 2^-126, the last ones by as much, so 2^-120 (|w|_1 + 1)
    /// covers both.
    Sign sign(const Corner& w) const noexcept {
        constexpr float bound = 4.5f * 0x1p-23f, underflow = 0x1p-120f;
        const Corner a = abs(w);
        const Lanes value = dot(normal_, w),
                    error = all(bound) * dot(size_, a) + all(underflow) * (a.x + a.y + a.z + all(1));
        return {value - error, all(0) - value - error, all(0) * (value + error)};
    }

 private:
    Corner normal_, size_;
};

/// For each corner of s, the side of t's plane on which it lies.
struct Sides {
    Sign of[3];
    Sides(const Corners& s, const Corners& t) noexcept {
        const Determinant plane(t.at[1] - t.at[0], t.at[2] - t.at[0]);
        for (int k = 0; k < 3; ++k) of[k] = plane.sign(s.at[k] - t.at[0]);
    }
    Lanes doubt() const noexcept { return of[0].doubt + of[1].doubt + of[2].doubt; }
};

/// The certainty that all signs are equal.
inline Lanes all_alike(const Sign& p, const Sign& q) noexcept {
    return max(min(p.positive, q.positive), min(p.negative, q.negative));
}
inline Lanes all_alike(const Sign& p, const Sign& q, const Sign& r) noexcept {
    return max(min(min(p.positive, q.positive), r.positive), min(min(p.negative, q.negative), r.negative));
}
/// The certainty that both signs occur.
inline Lanes both_occur(const Sign& p, const Sign& q) noexcept {
    return max(min(p.positive, q.negative), min(p.negative, q.positive));
}
inline Lanes both_occur(const Sign& p, const Sign& q, const Sign& r) noexcept {
    return min(max(max(p.positive, q.positive), r.positive), max(max(p.negative, q.negative), r.negative));
}

/// For two triangles, the certainty that an edge of one meets the other in one interior point (`meeting`),
/// and the certainty that no edge of one meets the other (`apart`).
struct Certainty {
    Lanes meeting = all(-infinity), apart = all(infinity);

    /// Adds an edge. p, q: sides of the other triangle's plane on which its ends lie. line0 to line2: sides
    /// of the edge's line on which the lines of the other triangle's edges pass. The edge crosses the plane
    /// if p and q differ. Its line passes through the triangle's interior if all three lines pass on one
    /// side, and misses even its border if they pass on both.
    void add(const Sign& p, const Sign& q, const Sign& line0, const Sign& line1, const Sign& line2) noexcept {
        meeting = max(meeting, min(both_occur(p, q), all_alike(line0, line1, line2)));
        apart = min(apart, max(all_alike(p, q), both_occur(line0, line1, line2)));
    }
};

unsigned separated_by_plane(const TrianglePack& first, const TrianglePack& second) noexcept {
    const Corners s(first), t(second);
    const Sides of_s(s, t), of_t(t, s);
    const Lanes one_side =
        max(all_alike(of_s.of[0], of_s.of[1], of_s.of[2]), all_alike(of_t.of[0], of_t.of[1], of_t.of[2]));
    return above(one_side + of_s.doubt() + of_t.doubt(), 0);
}

PackVerdict edges_meet_faces(const TrianglePack& first, const TrianglePack& second) noexcept {
    const Corners s(first), t(second);
    const Sides of_s(s, t), of_t(t, s);
    Lanes doubt = of_s.doubt() + of_t.doubt();
    Sign passing[3][3];  // [i][j]: the side of edge i of s on which edge j of t passes
    for (int i = 0; i < 3; ++i) {
        const Corner& start = s.at[i];
        const Corner along = s.at[(i + 1) % 3] - start;
        const Corner to_t[3] = {t.at[0] - start, t.at[1] - start, t.at[2] - start};
        for (int j = 0; j < 3; ++j) {
            passing[i][j] = Determinant(along, to_t[j]).sign(to_t[(j + 1) % 3]);
            doubt = doubt + passing[i][j].doubt;
        }
    }
    Certainty certainty;
    for (int i = 0; i < 3; ++i) {
        certainty.add(of_s.of[i], of_s.of[(i + 1) % 3], passing[i][0], passing[i][1], passing[i][2]);
        certainty.add(of_t.of[i], of_t.of[(i + 1) % 3], passing[0][i], passing[1][i], passing[2][i]);
    }
    return {above(certainty.meeting + doubt, 0), above(certainty.apart + doubt, 0)};
}

#include "collision/kernels/oriented.inl"
// Affine maps make oriented boxes, so they come second.
#include "collision/kernels/affine.inl"

// Fixed point

/// Exponent of the largest magnitude, biased by 127; 255 if a number is not finite.
inline std::int32_t largest_exponent(const float* x, int count) noexcept {
    Ints most = zeros();
    for (int i = 0; i < count; i += 16) most = max(most, magnitude_bits(x + i));
    return largest(most) >> 23;
}
constexpr std::int32_t not_finite = 255, next_to_nothing = 27;  // exponent of 2^-100
inline float power_of_two(std::int32_t biased_exponent) noexcept {
    return __builtin_bit_cast(float, biased_exponent << 23);
}

float fix(const float* x, int count, std::int16_t* fixed) noexcept {
    const std::int32_t exponent = largest_exponent(x, count);
    if (exponent == not_finite || exponent < next_to_nothing) {
        for (int i = 0; i < count; ++i) fixed[i] = 0;
        return exponent == not_finite ? __builtin_nanf("") : 0.f;
    }
    // The largest number times this factor lies between 2^13 and 2^14.
    const Lanes factor = all(power_of_two(2 * 127 + 13 - exponent));
    for (int i = 0; i < count; i += 16) store_rounded(load(x + i) * factor, fixed + i);
    return power_of_two(exponent - 13);
}

/// Like fix() with 8 bits, 0 to 255, for values after ReLU.
inline float fix_hidden(const float* x, int count, Hidden* fixed) noexcept {
    const std::int32_t exponent = largest_exponent(x, count);
    const bool known = exponent != not_finite && exponent >= next_to_nothing;
    const Lanes factor = all(known ? power_of_two(2 * 127 + 7 - exponent) : 0.f);
    for (int i = 0; i < count; i += 16) store_hidden(min(load(x + i) * factor, all(255)), fixed + i);
    return known ? power_of_two(exponent - 7) : exponent == not_finite ? __builtin_nanf("") : 0.f;
}

template <int count>
inline void column_products(const FixedColumns& columns, int first, const std::int16_t* x, float scale,
                            float* products) noexcept {
    Lanes sums[count];
    for (Lanes& sum : sums) sum = all(0);
    const int rows = columns.rows;
    const std::int16_t* values = columns.values + std::ptrdiff_t{first} * rows;
    constexpr int step = 32, steps = 4;  // 8 products per lane cannot overflow its sum
    for (int begin = 0; begin < rows; begin += steps * step) {
        const int end = rows - begin < steps * step ? rows : begin + steps * step;
        Ints whole[count];
        for (Ints& sum : whole) sum = zeros();
        for (int r = begin; r < end; r += step) {
            const Pairs factors = load_pairs(x + r);
            for (int c = 0; c < count; ++c)
                whole[c] = add_products(whole[c], load_pairs(values + std::ptrdiff_t{c} * rows + r), factors);
        }
        for (int c = 0; c < count; ++c) sums[c] = sums[c] + to_float(whole[c]);
    }
    for (int c = 0; c < count; ++c) products[first + c] = sum(sums[c]) * (columns.scales[first + c] * scale);
}

inline void all_products(const FixedColumns& columns, const std::int16_t* x, float scale,
                         float* products) noexcept {
    int c = 0;
    for (; c + 4 <= columns.count; c += 4) column_products<4>(columns, c, x, scale, products);
    switch (columns.count - c) {
        case 3:
            return column_products<3>(columns, c, x, scale, products);
        case 2:
            return column_products<2>(columns, c, x, scale, products);
        case 1:
            return column_products<1>(columns, c, x, scale, products);
    }
}

void products(const FixedColumns& columns, const std::int16_t* x, float scale, float* products) noexcept {
    all_products(columns, x, scale, products);
}

/// Outputs of layer l of some networks. The networks alternate, so that no sum waits for the previous one.
template <int count, int groups, class Inputs>
inline void layer_groups(const ByteLayer (*layers)[3], int l, int first, const Inputs* const (&inputs)[count],
                         const float (&scales)[count], float* const (&outputs)[count]) noexcept {
    typename Inputs::Sums sums[count][groups];
    const int quads = layers[0][l].quads, step = 4 * layers[0][l].outputs;
    const std::int8_t* weights[count];
    for (int n = 0; n < count; ++n) weights[n] = layers[n][l].weights + 4 * first;
    for (int q = 0; q < quads; ++q)
        for (int n = 0; n < count; ++n)
            for (int g = 0; g < groups; ++g) sums[n][g].add(weights[n] + q * step + 64 * g, *inputs[n], q);
    for (int n = 0; n < count; ++n)
        for (int g = 0; g < groups; ++g) {
            const ByteLayer& layer = layers[n][l];
            const int o = first + 16 * g;
            const Lanes result =
                to_float(sums[n][g].total(layer.sums + o)) * (load(layer.scales + o) * all(scales[n])) +
                load(layer.biases + o);
            store(layer.relu ? max(all(0), result) : result, outputs[n] + o);
        }
}
template <int count, class Inputs>
inline void layer_outputs(const ByteLayer (*layers)[3], int l, const Inputs* const (&inputs)[count],
                          const float (&scales)[count], float* const (&outputs)[count]) noexcept {
    int first = 0;
    for (; first + 32 <= layers[0][l].outputs; first += 32)
        layer_groups<count, 2>(layers, l, first, inputs, scales, outputs);
    if (first < layers[0][l].outputs) layer_groups<count, 1>(layers, l, first, inputs, scales, outputs);
}

template <int count>
inline void some_networks(const ByteLayer (*layers)[3], const FixedColumns& columns, const std::int16_t* x,
                          float scale, float (*outputs)[Kernels::outputs], float* products) noexcept {
    alignas(64) float h[count][Kernels::max_hidden];
    HiddenInputs hidden[count];
    const LayerInputs whole(x, 4 * layers[0][0].quads);
    const LayerInputs* inputs[count];
    const HiddenInputs* hidden_inputs[count];
    float scales[count], *results[count], *last[count];
    for (int n = 0; n < count; ++n) {
        inputs[n] = &whole;
        hidden_inputs[n] = &hidden[n];
        scales[n] = scale;
        results[n] = h[n];
        last[n] = outputs[n];
    }
    layer_outputs<count>(layers, 0, inputs, scales, results);
    for (int n = 0; n < count; ++n) scales[n] = fix_hidden(h[n], layers[n][0].outputs, hidden[n].x);
    all_products(columns, x, scale, products);
    layer_outputs<count>(layers, 1, hidden_inputs, scales, results);
    for (int n = 0; n < count; ++n) scales[n] = fix_hidden(h[n], layers[n][1].outputs, hidden[n].x);
    layer_outputs<count>(layers, 2, hidden_inputs, scales, last);
}

void networks(const ByteLayer (*layers)[3], int count, const FixedColumns& columns, const std::int16_t* x,
              float scale, float (*outputs)[Kernels::outputs], float* products) noexcept {
    static_assert(Kernels::max_networks == 2);
    if (count == 2)
        some_networks<2>(layers, columns, x, scale, outputs, products);
    else
        some_networks<1>(layers, columns, x, scale, outputs, products);
}

constexpr Kernels make_kernels(InstructionSet instructions) noexcept {
    return {.instructions = instructions,
            .overlapping = overlapping,
            .near = near,
            .overlapping_each = overlapping_each,
            .near_each = near_each,
            .overlapping_pairs = overlapping_pairs,
            .near_pairs = near_pairs,
            .box_of_points = box_of_points,
            .boxes_of_lists = boxes_of_lists,
            .boxes_of_points = boxes_of_points,
            .hull = hull,
            .clear_parted = clear_parted,
            .triangle_boxes = triangle_boxes,
            .pack_triangles = pack_triangles,
            .separated_by_plane = separated_by_plane,
            .edges_meet_faces = edges_meet_faces,
            .affine_map = affine_map,
            .fix = fix,
            .products = products,
            .networks = networks};
}
