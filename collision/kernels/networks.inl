// Fixed-point products and networks, part of kernels.inl.

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
