// Sixteen lanes in one AVX-512 register. lanes_plain.inl documents the functions.

struct Lanes {
    __m512 v;
};
struct Ints {
    __m512i v;
};
struct Pairs {
    __m512i v;
};

inline Lanes load(const float* p) noexcept { return {_mm512_loadu_ps(p)}; }
inline Lanes load_some(const float* p, int count) noexcept {
    return {_mm512_mask_loadu_ps(_mm512_set1_ps(p[0]), static_cast<__mmask16>((1u << count) - 1), p)};
}
inline void store(const Lanes& a, float* p) noexcept { _mm512_storeu_ps(p, a.v); }
inline Lanes gather(const float* base, const std::int32_t* offsets) noexcept {
    return {_mm512_i32gather_ps(_mm512_loadu_si512(offsets), base, 4)};
}
inline Lanes pick(const float* table, int count, const std::uint16_t* indices) noexcept {
    const __m512i at = _mm512_cvtepu16_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(indices)));
    if (count > 64) return {_mm512_i32gather_ps(at, table, 4)};
    const auto of_two = [&](const float* first, const float* second) {
        return _mm512_permutex2var_ps(_mm512_loadu_ps(first), at, _mm512_loadu_ps(second));
    };
    if (count <= 32) return {of_two(table, table + count - 16)};
    const __mmask16 upper = _mm512_cmpge_epi32_mask(at, _mm512_set1_epi32(32));
    return {_mm512_mask_blend_ps(upper, of_two(table, table + 16), of_two(table + 32, table + count - 16))};
}
inline Lanes load_rows(const float* p0, const float* p1, const float* p2, const float* p3) noexcept {
    __m512 v = _mm512_castps128_ps512(_mm_loadu_ps(p0));
    v = _mm512_insertf32x4(v, _mm_loadu_ps(p1), 1);
    v = _mm512_insertf32x4(v, _mm_loadu_ps(p2), 2);
    return {_mm512_insertf32x4(v, _mm_loadu_ps(p3), 3)};
}
template <class At>
inline void load_points(const At& at, Lanes (&xyz)[3]) noexcept {
    // Row r holds the points r, r + 4, r + 8 and r + 12.
    const auto row = [&](int r) { return load_rows(at(r), at(r + 4), at(r + 8), at(r + 12)).v; };
    const __m512 r0 = row(0), r1 = row(1), r2 = row(2), r3 = row(3);
    const __m512 xy01 = _mm512_unpacklo_ps(r0, r1), xy23 = _mm512_unpacklo_ps(r2, r3),
                 z01 = _mm512_unpackhi_ps(r0, r1), z23 = _mm512_unpackhi_ps(r2, r3);
    xyz[0] = {_mm512_shuffle_ps(xy01, xy23, 0x44)};
    xyz[1] = {_mm512_shuffle_ps(xy01, xy23, 0xee)};
    xyz[2] = {_mm512_shuffle_ps(z01, z23, 0x44)};
}
inline Lanes load_shorts(const std::int16_t* p) noexcept {
    const __m256i shorts = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
    return {_mm512_cvtepi32_ps(_mm512_cvtepi16_epi32(shorts))};
}
inline Lanes all(float x) noexcept { return {_mm512_set1_ps(x)}; }
inline Lanes operator+(const Lanes& a, const Lanes& b) noexcept { return {_mm512_add_ps(a.v, b.v)}; }
inline Lanes operator-(const Lanes& a, const Lanes& b) noexcept { return {_mm512_sub_ps(a.v, b.v)}; }
inline Lanes operator*(const Lanes& a, const Lanes& b) noexcept { return {_mm512_mul_ps(a.v, b.v)}; }
inline Lanes max(const Lanes& a, const Lanes& b) noexcept { return {_mm512_max_ps(a.v, b.v)}; }
inline Lanes min(const Lanes& a, const Lanes& b) noexcept { return {_mm512_min_ps(a.v, b.v)}; }
inline Lanes operator/(const Lanes& a, const Lanes& b) noexcept { return {_mm512_div_ps(a.v, b.v)}; }
inline Lanes root(const Lanes& a) noexcept { return {_mm512_sqrt_ps(a.v)}; }
inline Lanes abs(const Lanes& a) noexcept { return {_mm512_abs_ps(a.v)}; }
inline unsigned above(const Lanes& a, float limit) noexcept {
    return _mm512_cmp_ps_mask(a.v, _mm512_set1_ps(limit), _CMP_GT_OQ);
}
inline unsigned not_above(const Lanes& a, float limit) noexcept {
    return _mm512_cmp_ps_mask(a.v, _mm512_set1_ps(limit), _CMP_NGT_UQ);
}

inline Ints zeros() noexcept { return {_mm512_setzero_si512()}; }
inline Ints magnitude_bits(const float* p) noexcept {
    return {_mm512_and_si512(_mm512_loadu_si512(p), _mm512_set1_epi32(0x7fffffff))};
}
inline Ints max(const Ints& a, const Ints& b) noexcept { return {_mm512_max_epi32(a.v, b.v)}; }
inline std::int32_t largest(const Ints& a) noexcept { return _mm512_reduce_max_epi32(a.v); }
inline Lanes to_float(const Ints& a) noexcept { return {_mm512_cvtepi32_ps(a.v)}; }
inline void store_rounded(const Lanes& a, std::int16_t* p) noexcept {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), _mm512_cvtepi32_epi16(_mm512_cvtps_epi32(a.v)));
}

inline Pairs load_pairs(const std::int16_t* p) noexcept { return {_mm512_loadu_si512(p)}; }
inline Ints add_products(const Ints& a, const Pairs& p, const Pairs& q) noexcept {
    return {_mm512_dpwssd_epi32(a.v, p.v, q.v)};
}

// VNNI multiplies unsigned bytes by signed bytes, four at a time.

inline __m512i same_quad(const std::uint8_t* bytes) noexcept {
    std::int32_t bits;
    __builtin_memcpy(&bits, bytes, sizeof bits);
    return _mm512_set1_epi32(bits);
}
/// sum += the four products in each lane. Written in assembly because with the intrinsic, compilers copy the
/// sum between registers and load the bytes again for each of two products.
inline void add_byte_products(__m512i& sum, __m512i unsigned_bytes, __m512i bytes) noexcept {
    asm("vpdpbusd {%2, %1, %0|%0, %1, %2}" : "+v"(sum) : "v"(unsigned_bytes), "v"(bytes));
}
/// Stores sixteen bytes in the order of ByteLayer::at().
inline void store_quads(__m128i bytes, std::uint8_t* p) noexcept {
    const __m128i order = _mm_setr_epi8(0, 2, 1, 3, 4, 6, 5, 7, 8, 10, 9, 11, 12, 14, 13, 15);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(p), _mm_shuffle_epi8(bytes, order));
}

/// Inputs of the first layer in unsigned bytes: x + max_fixed = 256 * high + low.
struct LayerInputs {
    std::uint8_t high[Kernels::max_inputs], low[Kernels::max_inputs];
    LayerInputs(const std::int16_t* x, int count) noexcept {
        const __m256i offset = _mm256_set1_epi16(Kernels::max_fixed);
        for (int i = 0; i < count; i += 16) {
            const __m256i shifted =
                _mm256_add_epi16(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(x + i)), offset);
            store_quads(_mm256_cvtepi16_epi8(_mm256_srli_epi16(shifted, 8)), high + i);
            store_quads(_mm256_cvtepi16_epi8(shifted), low + i);
        }
    }
    struct Sums {
        __m512i high = _mm512_setzero_si512(), low = high;
        void add(const std::int8_t* weights, const LayerInputs& inputs, int quad) noexcept {
            const __m512i four = _mm512_loadu_si512(weights);
            add_byte_products(high, same_quad(inputs.high + 4 * quad), four);
            add_byte_products(low, same_quad(inputs.low + 4 * quad), four);
        }
        Ints total(const std::int32_t* weight_sums) const noexcept {
            const __m512i offsets = _mm512_slli_epi32(_mm512_loadu_si512(weight_sums), 14);
            return {_mm512_sub_epi32(_mm512_add_epi32(_mm512_slli_epi32(high, 8), low), offsets)};
        }
    };
};
using Hidden = std::uint8_t;
struct HiddenInputs {
    Hidden x[Kernels::max_hidden];
    struct Sums {
        Ints sums = zeros();
        void add(const std::int8_t* weights, const HiddenInputs& inputs, int quad) noexcept {
            add_byte_products(sums.v, same_quad(inputs.x + 4 * quad), _mm512_loadu_si512(weights));
        }
        Ints total(const std::int32_t*) const noexcept { return sums; }
    };
};
inline void store_hidden(const Lanes& a, Hidden* p) noexcept {
    store_quads(_mm512_cvtepi32_epi8(_mm512_cvtps_epi32(a.v)), p);
}

inline float sum(const Lanes& a) noexcept {
    const __m256 eight = _mm256_add_ps(_mm512_castps512_ps256(a.v), _mm512_extractf32x8_ps(a.v, 1));
    const __m128 four = _mm_add_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
    const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_add_ss(two, _mm_movehdup_ps(two)));
}
struct Least {
    __m128 operator()(__m128 a, __m128 b) const noexcept { return _mm_min_ps(a, b); }
    __m256 operator()(__m256 a, __m256 b) const noexcept { return _mm256_min_ps(a, b); }
    __m512 operator()(__m512 a, __m512 b) const noexcept { return _mm512_min_ps(a, b); }
};
struct Most {
    __m128 operator()(__m128 a, __m128 b) const noexcept { return _mm_max_ps(a, b); }
    __m256 operator()(__m256 a, __m256 b) const noexcept { return _mm256_max_ps(a, b); }
    __m512 operator()(__m512 a, __m512 b) const noexcept { return _mm512_max_ps(a, b); }
};
template <class Join>
inline void store_joined(const Lanes& a, float* p) noexcept {
    constexpr Join join{};
    const __m256 eight = join(_mm512_castps512_ps256(a.v), _mm512_extractf32x8_ps(a.v, 1));
    const __m128 four = join(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
    _mm_storeu_ps(p, _mm_blend_ps(four, _mm_setzero_ps(), 8));
}
template <class Join>
inline void store_joined(const Lanes (&xyz)[3], float* p) noexcept {
    constexpr Join join{};
    const __m512 x = xyz[0].v, y = xyz[1].v, z = xyz[2].v;
    const __m512 xy = join(_mm512_unpacklo_ps(x, y), _mm512_unpackhi_ps(x, y)),
                 zz = join(_mm512_unpacklo_ps(z, z), _mm512_unpackhi_ps(z, z));
    const __m512 points = join(_mm512_shuffle_ps(xy, zz, 0x44), _mm512_shuffle_ps(xy, zz, 0xee));
    store_joined<Join>(Lanes{points}, p);
}
