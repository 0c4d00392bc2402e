// Sixteen lanes in two AVX2 registers. lanes_plain.inl documents the functions.

struct Lanes {
    __m256 v[2];
};
struct Ints {
    __m256i v[2];
};
struct Pairs {
    __m256i v[2];
};

inline Lanes load(const float* p) noexcept { return {{_mm256_loadu_ps(p), _mm256_loadu_ps(p + 8)}}; }
inline Lanes load_some(const float* p, int count) noexcept {
    const __m256i last = _mm256_set1_epi32(count - 1), first = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    const __m256 repeated = _mm256_set1_ps(p[0]);
    const auto eight = [&](const float* at, __m256i lanes) {
        const __m256 beyond = _mm256_castsi256_ps(_mm256_cmpgt_epi32(lanes, last));
        return _mm256_blendv_ps(_mm256_loadu_ps(at), repeated, beyond);
    };
    return {{eight(p, first), eight(p + 8, _mm256_add_epi32(first, _mm256_set1_epi32(8)))}};
}
inline void store(const Lanes& a, float* p) noexcept {
    _mm256_storeu_ps(p, a.v[0]);
    _mm256_storeu_ps(p + 8, a.v[1]);
}
inline Lanes gather(const float* base, const std::int32_t* offsets) noexcept {
    const __m256i* at = reinterpret_cast<const __m256i*>(offsets);
    return {{_mm256_i32gather_ps(base, _mm256_loadu_si256(at), 4),
             _mm256_i32gather_ps(base, _mm256_loadu_si256(at + 1), 4)}};
}
inline Lanes pick(const float* table, int, const std::uint16_t* indices) noexcept {
    const auto eight = [&](int first) {
        const __m128i at = _mm_loadu_si128(reinterpret_cast<const __m128i*>(indices + first));
        return _mm256_i32gather_ps(table, _mm256_cvtepu16_epi32(at), 4);
    };
    return {{eight(0), eight(8)}};
}
inline Lanes load_rows(const float* p0, const float* p1, const float* p2, const float* p3) noexcept {
    const auto two = [](const float* p, const float* q) {
        return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(p)), _mm_loadu_ps(q), 1);
    };
    return {{two(p0, p1), two(p2, p3)}};
}
template <class At>
inline void load_points(const At& at, Lanes (&xyz)[3]) noexcept {
    for (int half = 0; half < 2; ++half) {
        // Row r holds the points r and r + 4 of this half.
        const auto row = [&](int r) {
            const __m256 v = _mm256_castps128_ps256(_mm_loadu_ps(at(8 * half + r)));
            return _mm256_insertf128_ps(v, _mm_loadu_ps(at(8 * half + r + 4)), 1);
        };
        const __m256 r0 = row(0), r1 = row(1), r2 = row(2), r3 = row(3);
        const __m256 xy01 = _mm256_unpacklo_ps(r0, r1), xy23 = _mm256_unpacklo_ps(r2, r3),
                     z01 = _mm256_unpackhi_ps(r0, r1), z23 = _mm256_unpackhi_ps(r2, r3);
        xyz[0].v[half] = _mm256_shuffle_ps(xy01, xy23, 0x44);
        xyz[1].v[half] = _mm256_shuffle_ps(xy01, xy23, 0xee);
        xyz[2].v[half] = _mm256_shuffle_ps(z01, z23, 0x44);
    }
}
inline Lanes load_shorts(const std::int16_t* p) noexcept {
    const __m128i* at = reinterpret_cast<const __m128i*>(p);
    const auto floats = [](__m128i shorts) { return _mm256_cvtepi32_ps(_mm256_cvtepi16_epi32(shorts)); };
    return {{floats(_mm_loadu_si128(at)), floats(_mm_loadu_si128(at + 1))}};
}
inline Lanes all(float x) noexcept { return {{_mm256_set1_ps(x), _mm256_set1_ps(x)}}; }
inline Lanes operator+(const Lanes& a, const Lanes& b) noexcept {
    return {{_mm256_add_ps(a.v[0], b.v[0]), _mm256_add_ps(a.v[1], b.v[1])}};
}
inline Lanes operator-(const Lanes& a, const Lanes& b) noexcept {
    return {{_mm256_sub_ps(a.v[0], b.v[0]), _mm256_sub_ps(a.v[1], b.v[1])}};
}
inline Lanes operator*(const Lanes& a, const Lanes& b) noexcept {
    return {{_mm256_mul_ps(a.v[0], b.v[0]), _mm256_mul_ps(a.v[1], b.v[1])}};
}
inline Lanes max(const Lanes& a, const Lanes& b) noexcept {
    return {{_mm256_max_ps(a.v[0], b.v[0]), _mm256_max_ps(a.v[1], b.v[1])}};
}
inline Lanes min(const Lanes& a, const Lanes& b) noexcept {
    return {{_mm256_min_ps(a.v[0], b.v[0]), _mm256_min_ps(a.v[1], b.v[1])}};
}
inline Lanes operator/(const Lanes& a, const Lanes& b) noexcept {
    return {{_mm256_div_ps(a.v[0], b.v[0]), _mm256_div_ps(a.v[1], b.v[1])}};
}
inline Lanes root(const Lanes& a) noexcept { return {{_mm256_sqrt_ps(a.v[0]), _mm256_sqrt_ps(a.v[1])}}; }
inline Lanes abs(const Lanes& a) noexcept {
    const __m256 sign = _mm256_set1_ps(-0.f);
    return {{_mm256_andnot_ps(sign, a.v[0]), _mm256_andnot_ps(sign, a.v[1])}};
}
inline unsigned above(const Lanes& a, float limit) noexcept {
    const __m256 limits = _mm256_set1_ps(limit);
    const int low = _mm256_movemask_ps(_mm256_cmp_ps(a.v[0], limits, _CMP_GT_OQ)),
              high = _mm256_movemask_ps(_mm256_cmp_ps(a.v[1], limits, _CMP_GT_OQ));
    return low | high << 8;
}
inline unsigned not_above(const Lanes& a, float limit) noexcept { return ~above(a, limit) & 0xffffu; }

inline __m256i load_ints(const void* p) noexcept {
    return _mm256_loadu_si256(static_cast<const __m256i*>(p));
}
inline Ints zeros() noexcept { return {{_mm256_setzero_si256(), _mm256_setzero_si256()}}; }
inline Ints magnitude_bits(const float* p) noexcept {
    const __m256i mask = _mm256_set1_epi32(0x7fffffff);
    return {{_mm256_and_si256(load_ints(p), mask), _mm256_and_si256(load_ints(p + 8), mask)}};
}
inline Ints max(const Ints& a, const Ints& b) noexcept {
    return {{_mm256_max_epi32(a.v[0], b.v[0]), _mm256_max_epi32(a.v[1], b.v[1])}};
}
inline std::int32_t largest(const Ints& a) noexcept {
    const __m256i eight = _mm256_max_epi32(a.v[0], a.v[1]);
    const __m128i four = _mm_max_epi32(_mm256_castsi256_si128(eight), _mm256_extracti128_si256(eight, 1));
    const __m128i two = _mm_max_epi32(four, _mm_unpackhi_epi64(four, four));
    return _mm_cvtsi128_si32(_mm_max_epi32(two, _mm_shuffle_epi32(two, 1)));
}
inline Lanes to_float(const Ints& a) noexcept {
    return {{_mm256_cvtepi32_ps(a.v[0]), _mm256_cvtepi32_ps(a.v[1])}};
}
inline void store_rounded(const Lanes& a, std::int16_t* p) noexcept {
    const __m256i low = _mm256_cvtps_epi32(a.v[0]), high = _mm256_cvtps_epi32(a.v[1]);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(p),
                        _mm256_permute4x64_epi64(_mm256_packs_epi32(low, high), 0xd8));
}

inline Pairs load_pairs(const std::int16_t* p) noexcept { return {{load_ints(p), load_ints(p + 16)}}; }
inline __m256i same_pair(const std::int16_t* p) noexcept {
    std::int32_t pair;
    __builtin_memcpy(&pair, p, sizeof pair);
    return _mm256_set1_epi32(pair);
}
inline Ints add_products(const Ints& a, const Pairs& p, const Pairs& q) noexcept {
    return {{_mm256_add_epi32(a.v[0], _mm256_madd_epi16(p.v[0], q.v[0])),
             _mm256_add_epi32(a.v[1], _mm256_madd_epi16(p.v[1], q.v[1]))}};
}

struct LayerSums {
    Ints sums = zeros();
    template <class Inputs>
    void add(const std::int8_t* weights, const Inputs& inputs, int quad) noexcept {
        const __m256i first = same_pair(inputs.x + 4 * quad), second = same_pair(inputs.x + 4 * quad + 2);
        for (int half = 0; half < 2; ++half) {
            const __m256i four = load_ints(weights + 32 * half);
            const __m256i low = _mm256_srai_epi16(_mm256_slli_epi16(four, 8), 8),
                          high = _mm256_srai_epi16(four, 8);
            sums.v[half] = _mm256_add_epi32(sums.v[half], _mm256_add_epi32(_mm256_madd_epi16(low, first),
                                                                           _mm256_madd_epi16(high, second)));
        }
    }
    Ints total(const std::int32_t*) const noexcept { return sums; }
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
    const __m256 eight = _mm256_add_ps(a.v[0], a.v[1]);
    const __m128 four = _mm_add_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
    const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_add_ss(two, _mm_movehdup_ps(two)));
}
struct Least {
    __m128 operator()(__m128 a, __m128 b) const noexcept { return _mm_min_ps(a, b); }
    __m256 operator()(__m256 a, __m256 b) const noexcept { return _mm256_min_ps(a, b); }
};
struct Most {
    __m128 operator()(__m128 a, __m128 b) const noexcept { return _mm_max_ps(a, b); }
    __m256 operator()(__m256 a, __m256 b) const noexcept { return _mm256_max_ps(a, b); }
};
template <class Join>
inline void store_joined(const Lanes& a, float* p) noexcept {
    constexpr Join join{};
    const __m256 eight = join(a.v[0], a.v[1]);
    const __m128 four = join(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
    _mm_storeu_ps(p, _mm_blend_ps(four, _mm_setzero_ps(), 8));
}
template <class Join>
inline void store_joined(const Lanes (&xyz)[3], float* p) noexcept {
    constexpr Join join{};
    Lanes points;
    for (int half = 0; half < 2; ++half) {
        const __m256 x = xyz[0].v[half], y = xyz[1].v[half], z = xyz[2].v[half];
        const __m256 xy = join(_mm256_unpacklo_ps(x, y), _mm256_unpackhi_ps(x, y)),
                     zz = join(_mm256_unpacklo_ps(z, z), _mm256_unpackhi_ps(z, z));
        points.v[half] = join(_mm256_shuffle_ps(xy, zz, 0x44), _mm256_shuffle_ps(xy, zz, 0xee));
    }
    store_joined<Join>(points, p);
}
