// Sixteen lanes in plain C++: the definition that the other forms must match, and the form for all other
// CPUs.

struct Lanes {
    float v[16];
};
struct Ints {
    std::int32_t v[16];
};
/// Two neighbouring numbers per lane.
struct Pairs {
    std::int16_t first[16], second[16];
};

template <class F>
inline Lanes each(const F& f) noexcept {
    Lanes result;
    for (int k = 0; k < 16; ++k) result.v[k] = f(k);
    return result;
}

inline Lanes load(const float* p) noexcept {
    return each([&](int k) { return p[k]; });
}
/// The first `count` numbers, 1 to 16; lanes beyond them repeat the first. Reads sixteen.
inline Lanes load_some(const float* p, int count) noexcept {
    return each([&](int k) { return p[k < count ? k : 0]; });
}
inline void store(const Lanes& a, float* p) noexcept {
    for (int k = 0; k < 16; ++k) p[k] = a.v[k];
}
/// base[offsets[k]] in lane k.
inline Lanes gather(const float* base, const std::int32_t* offsets) noexcept {
    return each([&](int k) { return base[offsets[k]]; });
}
/// table[indices[k]] in lane k. count: numbers in the table, a multiple of 16.
inline Lanes pick(const float* table, int, const std::uint16_t* indices) noexcept {
    return each([&](int k) { return table[indices[k]]; });
}
/// Four points side by side, with the number that follows each of them.
inline Lanes load_rows(const float* p0, const float* p1, const float* p2, const float* p3) noexcept {
    const float* points[4] = {p0, p1, p2, p3};
    return each([&](int k) { return points[k / 4][k % 4]; });
}
/// The coordinates of sixteen points, one per lane. at(k): where point k stands; reads a fourth number there.
template <class At>
inline void load_points(const At& at, Lanes (&xyz)[3]) noexcept {
    for (int axis = 0; axis < 3; ++axis) xyz[axis] = each([&](int k) { return at(k)[axis]; });
}
inline Lanes load_shorts(const std::int16_t* p) noexcept {
    return each([&](int k) { return static_cast<float>(p[k]); });
}
inline Lanes all(float x) noexcept {
    return each([&](int) { return x; });
}
inline Lanes operator+(const Lanes& a, const Lanes& b) noexcept {
    return each([&](int k) { return a.v[k] + b.v[k]; });
}
inline Lanes operator-(const Lanes& a, const Lanes& b) noexcept {
    return each([&](int k) { return a.v[k] - b.v[k]; });
}
inline Lanes operator*(const Lanes& a, const Lanes& b) noexcept {
    return each([&](int k) { return a.v[k] * b.v[k]; });
}
/// Maximum and, below, minimum: b if either is NaN or both are equal.
inline Lanes max(const Lanes& a, const Lanes& b) noexcept {
    return each([&](int k) { return a.v[k] > b.v[k] ? a.v[k] : b.v[k]; });
}
inline Lanes min(const Lanes& a, const Lanes& b) noexcept {
    return each([&](int k) { return a.v[k] < b.v[k] ? a.v[k] : b.v[k]; });
}
inline Lanes operator/(const Lanes& a, const Lanes& b) noexcept {
    return each([&](int k) { return a.v[k] / b.v[k]; });
}
inline Lanes root(const Lanes& a) noexcept {
    return each([&](int k) { return __builtin_sqrtf(a.v[k]); });
}
inline Lanes abs(const Lanes& a) noexcept {
    return each([&](int k) { return __builtin_fabsf(a.v[k]); });
}
/// Sets bit k if a > limit in lane k; never for NaN.
inline unsigned above(const Lanes& a, float limit) noexcept {
    unsigned mask = 0;
    for (int k = 0; k < 16; ++k) mask |= static_cast<unsigned>(a.v[k] > limit) << k;
    return mask;
}
/// Sets bit k unless a > limit in lane k; always for NaN.
inline unsigned not_above(const Lanes& a, float limit) noexcept { return ~above(a, limit) & 0xffffu; }

inline Ints zeros() noexcept { return {}; }
/// Bits without the sign. As integers they are in the order of magnitudes, then infinity, then NaN.
inline Ints magnitude_bits(const float* p) noexcept {
    Ints result;
    for (int k = 0; k < 16; ++k) result.v[k] = __builtin_bit_cast(std::uint32_t, p[k]) & 0x7fffffffu;
    return result;
}
inline Ints max(const Ints& a, const Ints& b) noexcept {
    Ints result;
    for (int k = 0; k < 16; ++k) result.v[k] = a.v[k] > b.v[k] ? a.v[k] : b.v[k];
    return result;
}
inline std::int32_t largest(const Ints& a) noexcept {
    std::int32_t most = a.v[0];
    for (int k = 1; k < 16; ++k) most = a.v[k] > most ? a.v[k] : most;
    return most;
}
inline Lanes to_float(const Ints& a) noexcept {
    return each([&](int k) { return static_cast<float>(a.v[k]); });
}
/// Stores sixteen numbers rounded to nearest, ties to even.
inline void store_rounded(const Lanes& a, std::int16_t* p) noexcept {
    for (int k = 0; k < 16; ++k) p[k] = static_cast<std::int16_t>(__builtin_rintf(a.v[k]));
}

template <class T>
inline Pairs load_pairs(const T* p) noexcept {
    Pairs result;
    for (int k = 0; k < 16; ++k) {
        result.first[k] = p[2 * k];
        result.second[k] = p[2 * k + 1];
    }
    return result;
}
/// Returns a plus the sum of the two products in each lane.
inline Ints add_products(const Ints& a, const Pairs& p, const Pairs& q) noexcept {
    Ints result;
    for (int k = 0; k < 16; ++k) result.v[k] = a.v[k] + p.first[k] * q.first[k] + p.second[k] * q.second[k];
    return result;
}

/// Sums over a layer's inputs for sixteen outputs.
struct LayerSums {
    Ints sums{};
    /// Adds four inputs, starting at 4 * quad, in the order of ByteLayer::at().
    template <class Inputs>
    void add(const std::int8_t* weights, const Inputs& inputs, int quad) noexcept {
        const std::int16_t* x = inputs.x + 4 * quad;
        for (int k = 0; k < 16; ++k)
            sums.v[k] += weights[4 * k] * x[0] + weights[4 * k + 2] * x[1] + weights[4 * k + 1] * x[2] +
                         weights[4 * k + 3] * x[3];
    }
    /// The sums. weight_sums: sum of the weights of each output, for forms that need it.
    Ints total(const std::int32_t*) const noexcept { return sums; }
};
/// Inputs of the first layer, from fix().
struct LayerInputs {
    using Sums = LayerSums;
    const std::int16_t* x;
    LayerInputs(const std::int16_t* fixed, int) noexcept : x(fixed) {}
};
/// Inputs of the other layers: integers from 0 to 255.
using Hidden = std::int16_t;
struct HiddenInputs {
    using Sums = LayerSums;
    Hidden x[Kernels::max_hidden];
};
inline void store_hidden(const Lanes& a, Hidden* p) noexcept { store_rounded(a, p); }

/// Sum of all lanes in a fixed order: lanes 8 apart first, then 4, 2, 1.
inline float sum(const Lanes& a) noexcept {
    float s[8];
    for (int k = 0; k < 8; ++k) s[k] = a.v[k] + a.v[k + 8];
    for (int k = 0; k < 4; ++k) s[k] += s[k + 4];
    return (s[0] + s[2]) + (s[1] + s[3]);
}
/// How lanes are joined: the smaller or the larger of two numbers; the second if either is NaN or both are
/// equal.
struct Least {
    float operator()(float a, float b) const noexcept { return a < b ? a : b; }
};
struct Most {
    float operator()(float a, float b) const noexcept { return a > b ? a : b; }
};
/// Joins four points from load_rows() and stores x, y, z and 0.
template <class Join>
inline void store_joined(const Lanes& points, float* p) noexcept {
    constexpr Join join{};
    const float* v = points.v;
    for (int axis = 0; axis < 3; ++axis)
        p[axis] = join(join(v[axis], v[axis + 8]), join(v[axis + 4], v[axis + 12]));
    p[3] = 0;
}
/// Likewise sixteen points, one per lane.
template <class Join>
inline void store_joined(const Lanes (&xyz)[3], float* p) noexcept {
    constexpr Join join{};
    Lanes points;
    for (int axis = 0; axis < 3; ++axis)
        for (int k = 0; k < 16; k += 4) {
            const float* v = xyz[axis].v + k;
            points.v[k + axis] = join(join(v[0], v[2]), join(v[1], v[3]));
        }
    store_joined<Join>(points, p);
}
