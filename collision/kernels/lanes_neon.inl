// Sixteen lanes in four NEON registers of 64-bit Arm. lanes_plain.inl documents the functions.

struct Lanes {
    float32x4_t v[4];
};
struct Ints {
    int32x4_t v[4];
};
/// Eight lanes to a register; so instructions with two registers take apart what lies together.
struct Pairs {
    int16x8_t first[2], second[2];
};

template <class F>
inline Lanes each(const F& f) noexcept {
    return {{f(0), f(1), f(2), f(3)}};
}
template <class F>
inline Ints each_int(const F& f) noexcept {
    return {{f(0), f(1), f(2), f(3)}};
}

inline Lanes load(const float* p) noexcept {
    return each([&](int r) { return vld1q_f32(p + 4 * r); });
}
inline Lanes load_some(const float* p, int count) noexcept {
    const float32x4_t repeated = vdupq_n_f32(p[0]);
    return each([&](int r) {
        const std::int32_t lanes[4] = {4 * r, 4 * r + 1, 4 * r + 2, 4 * r + 3};
        return vbslq_f32(vcltq_s32(vld1q_s32(lanes), vdupq_n_s32(count)), vld1q_f32(p + 4 * r), repeated);
    });
}
inline void store(const Lanes& a, float* p) noexcept {
    for (int r = 0; r < 4; ++r) vst1q_f32(p + 4 * r, a.v[r]);
}
/// NEON does not gather: at(k) is loaded into lane k, one after the other.
template <class At>
inline Lanes load_each(const At& at) noexcept {
    return each([&](int r) {
        float32x4_t v = vld1q_dup_f32(at(4 * r));
        v = vld1q_lane_f32(at(4 * r + 1), v, 1);
        v = vld1q_lane_f32(at(4 * r + 2), v, 2);
        return vld1q_lane_f32(at(4 * r + 3), v, 3);
    });
}
inline Lanes gather(const float* base, const std::int32_t* offsets) noexcept {
    return load_each([&](int k) { return base + offsets[k]; });
}
inline Lanes pick(const float* table, int, const std::uint16_t* indices) noexcept {
    return load_each([&](int k) { return table + indices[k]; });
}
inline Lanes load_rows(const float* p0, const float* p1, const float* p2, const float* p3) noexcept {
    return {{vld1q_f32(p0), vld1q_f32(p1), vld1q_f32(p2), vld1q_f32(p3)}};
}
template <class At>
inline void load_points(const At& at, Lanes (&xyz)[3]) noexcept {
    for (int r = 0; r < 4; ++r) {
        const float32x4_t p0 = vld1q_f32(at(4 * r)), p1 = vld1q_f32(at(4 * r + 1)),
                          p2 = vld1q_f32(at(4 * r + 2)), p3 = vld1q_f32(at(4 * r + 3));
        const float32x4_t xy02 = vzip1q_f32(p0, p2), xy13 = vzip1q_f32(p1, p3);
        xyz[0].v[r] = vzip1q_f32(xy02, xy13);
        xyz[1].v[r] = vzip2q_f32(xy02, xy13);
        xyz[2].v[r] = vzip1q_f32(vzip2q_f32(p0, p2), vzip2q_f32(p1, p3));
    }
}
inline Lanes load_shorts(const std::int16_t* p) noexcept {
    return each([&](int r) { return vcvtq_f32_s32(vmovl_s16(vld1_s16(p + 4 * r))); });
}
inline Lanes all(float x) noexcept {
    return each([&](int) { return vdupq_n_f32(x); });
}
inline Lanes operator+(const Lanes& a, const Lanes& b) noexcept {
    return each([&](int r) { return vaddq_f32(a.v[r], b.v[r]); });
}
inline Lanes operator-(const Lanes& a, const Lanes& b) noexcept {
    return each([&](int r) { return vsubq_f32(a.v[r], b.v[r]); });
}
inline Lanes operator*(const Lanes& a, const Lanes& b) noexcept {
    return each([&](int r) { return vmulq_f32(a.v[r], b.v[r]); });
}
/// Instructions of their own for these pass on NaN and part 0 from -0, so they give other bits.
inline float32x4_t larger(float32x4_t a, float32x4_t b) noexcept { return vbslq_f32(vcgtq_f32(a, b), a, b); }
inline float32x4_t smaller(float32x4_t a, float32x4_t b) noexcept { return vbslq_f32(vcltq_f32(a, b), a, b); }
inline Lanes max(const Lanes& a, const Lanes& b) noexcept {
    return each([&](int r) { return larger(a.v[r], b.v[r]); });
}
inline Lanes min(const Lanes& a, const Lanes& b) noexcept {
    return each([&](int r) { return smaller(a.v[r], b.v[r]); });
}
inline Lanes operator/(const Lanes& a, const Lanes& b) noexcept {
    return each([&](int r) { return vdivq_f32(a.v[r], b.v[r]); });
}
inline Lanes root(const Lanes& a) noexcept {
    return each([&](int r) { return vsqrtq_f32(a.v[r]); });
}
inline Lanes abs(const Lanes& a) noexcept {
    return each([&](int r) { return vabsq_f32(a.v[r]); });
}
inline unsigned above(const Lanes& a, float limit) noexcept {
    constexpr std::uint32_t lane_bits[4] = {1, 2, 4, 8};
    const float32x4_t limits = vdupq_n_f32(limit);
    const uint32x4_t bits = vld1q_u32(lane_bits);
    const auto found = [&](int r) { return vandq_u32(vcgtq_f32(a.v[r], limits), bits); };
    const uint32x4_t low = vorrq_u32(found(0), vshlq_n_u32(found(1), 4)),
                     high = vorrq_u32(found(2), vshlq_n_u32(found(3), 4));
    return vaddvq_u32(vorrq_u32(low, vshlq_n_u32(high, 8)));
}
inline unsigned not_above(const Lanes& a, float limit) noexcept { return ~above(a, limit) & 0xffffu; }

inline Ints zeros() noexcept {
    return each_int([](int) { return vdupq_n_s32(0); });
}
inline Ints magnitude_bits(const float* p) noexcept {
    return each_int([&](int r) { return vreinterpretq_s32_f32(vabsq_f32(vld1q_f32(p + 4 * r))); });
}
inline Ints max(const Ints& a, const Ints& b) noexcept {
    return each_int([&](int r) { return vmaxq_s32(a.v[r], b.v[r]); });
}
inline std::int32_t largest(const Ints& a) noexcept {
    return vmaxvq_s32(vmaxq_s32(vmaxq_s32(a.v[0], a.v[1]), vmaxq_s32(a.v[2], a.v[3])));
}
inline Lanes to_float(const Ints& a) noexcept {
    return each([&](int r) { return vcvtq_f32_s32(a.v[r]); });
}
inline void store_rounded(const Lanes& a, std::int16_t* p) noexcept {
    for (int r = 0; r < 4; ++r) vst1_s16(p + 4 * r, vqmovn_s32(vcvtnq_s32_f32(a.v[r])));
}

inline Pairs load_pairs(const std::int16_t* p) noexcept {
    const int16x8x2_t low = vld2q_s16(p), high = vld2q_s16(p + 16);
    return {{low.val[0], high.val[0]}, {low.val[1], high.val[1]}};
}
inline Ints add_products(const Ints& a, const Pairs& p, const Pairs& q) noexcept {
    Ints sums = a;
    for (int half = 0; half < 2; ++half) {
        int32x4_t &low = sums.v[2 * half], &high = sums.v[2 * half + 1];
        low = vmlal_s16(low, vget_low_s16(p.first[half]), vget_low_s16(q.first[half]));
        low = vmlal_s16(low, vget_low_s16(p.second[half]), vget_low_s16(q.second[half]));
        high = vmlal_high_s16(high, p.first[half], q.first[half]);
        high = vmlal_high_s16(high, p.second[half], q.second[half]);
    }
    return sums;
}

struct LayerSums {
    Ints sums = zeros();
    template <class Inputs>
    void add(const std::int8_t* weights, const Inputs& inputs, int quad) noexcept {
        const int16x4_t x = vld1_s16(inputs.x + 4 * quad);
        const int8x16x4_t four = vld4q_s8(weights);  // in the order of ByteLayer::at()
        add_input<0>(four.val[0], x);
        add_input<2>(four.val[1], x);
        add_input<1>(four.val[2], x);
        add_input<3>(four.val[3], x);
    }
    Ints total(const std::int32_t*) const noexcept { return sums; }

 private:
    template <int input>
    void add_input(int8x16_t weights, int16x4_t x) noexcept {
        const int16x8_t low = vmovl_s8(vget_low_s8(weights)), high = vmovl_high_s8(weights);
        sums.v[0] = vmlal_lane_s16(sums.v[0], vget_low_s16(low), x, input);
        sums.v[1] = vmlal_high_lane_s16(sums.v[1], low, x, input);
        sums.v[2] = vmlal_lane_s16(sums.v[2], vget_low_s16(high), x, input);
        sums.v[3] = vmlal_high_lane_s16(sums.v[3], high, x, input);
    }
};
struct LayerInputs {
    using Sums = LayerSums;
    const std::int16_t* x;
    LayerInputs(const std::int16_t* fixed, int) noexcept : x(fixed) {}
};
using Hidden = std::int16_t;
struct HiddenInputs {
    using Sums = LayerSums;
    Hidden x[Kernels::max_hidden];
};
inline void store_hidden(const Lanes& a, Hidden* p) noexcept { store_rounded(a, p); }

inline float sum(const Lanes& a) noexcept {
    const float32x4_t four = vaddq_f32(vaddq_f32(a.v[0], a.v[2]), vaddq_f32(a.v[1], a.v[3]));
    const float32x2_t two = vadd_f32(vget_low_f32(four), vget_high_f32(four));
    return vget_lane_f32(two, 0) + vget_lane_f32(two, 1);
}
struct Least {
    float32x4_t operator()(float32x4_t a, float32x4_t b) const noexcept { return smaller(a, b); }
};
struct Most {
    float32x4_t operator()(float32x4_t a, float32x4_t b) const noexcept { return larger(a, b); }
};
template <class Join>
inline void store_joined(const Lanes& a, float* p) noexcept {
    constexpr Join join{};
    const float32x4_t four = join(join(a.v[0], a.v[2]), join(a.v[1], a.v[3]));
    vst1q_f32(p, vsetq_lane_f32(0, four, 3));
}
template <class Join>
inline void store_joined(const Lanes (&xyz)[3], float* p) noexcept {
    constexpr Join join{};
    const Lanes points = each([&](int r) {
        const float32x4_t x = xyz[0].v[r], y = xyz[1].v[r], z = xyz[2].v[r];
        const float32x4_t xy = join(vzip1q_f32(x, y), vzip2q_f32(x, y)),
                          zz = join(vzip1q_f32(z, z), vzip2q_f32(z, z));
        return join(vcombine_f32(vget_low_f32(xy), vget_low_f32(zz)),
                    vcombine_f32(vget_high_f32(xy), vget_high_f32(zz)));
    });
    store_joined<Join>(points, p);
}
