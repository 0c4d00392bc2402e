// Boxes around points, boxes and triangles, part of kernels.inl.

/// doubt: sums of 0 p over points p side by side, NaN where a coordinate is not finite.
inline bool are_finite(const Lanes& doubt) noexcept {
    constexpr unsigned coordinates = 0x7777;
    return (above(doubt, -1) & coordinates) == coordinates;
}

bool box_of_points(const float* x, const std::int32_t* places, int count, float* box) noexcept {
    constexpr int chains = 2;                     // independent minima, so that none waits for the one before
    Lanes lo[chains], hi[chains], doubt[chains];  // four points side by side
    for (int chain = 0; chain < chains; ++chain) {
        lo[chain] = all(infinity);
        hi[chain] = all(-infinity);
        doubt[chain] = all(0);  // minima lose NaN
    }
    const auto add = [&](int chain, int i, int j, int k, int l) {
        const Lanes p = load_rows(x + places[i], x + places[j], x + places[k], x + places[l]);
        lo[chain] = min(lo[chain], p);
        hi[chain] = max(hi[chain], p);
        doubt[chain] = doubt[chain] + all(0) * p;
    };
    int k = 0;
    for (; k + 4 * chains <= count; k += 4 * chains)
        for (int chain = 0; chain < chains; ++chain) {
            const int i = k + 4 * chain;
            add(chain, i, i + 1, i + 2, i + 3);
        }
    const auto within = [&](int i) { return i < count ? i : count - 1; };
    for (; k < count; k += 4) add(0, k, within(k + 1), within(k + 2), within(k + 3));
    store_joined<Least>(min(lo[0], lo[1]), box);
    store_joined<Most>(max(hi[0], hi[1]), box + 4);
    return are_finite(doubt[0] + doubt[1]);
}

bool boxes_of_lists(const float* x, const std::int32_t* places, const std::int32_t* counts, int lists,
                    float* boxes) noexcept {
    Lanes doubt = all(0);
    for (int list = 0; list < lists; ++list) {
        Lanes lo = all(infinity), hi = all(-infinity);
        for (const std::int32_t* end = places + counts[list]; places != end; places += 4) {
            const Lanes p = load_rows(x + places[0], x + places[1], x + places[2], x + places[3]);
            lo = min(lo, p);
            hi = max(hi, p);
            doubt = doubt + all(0) * p;
        }
        store_joined<Least>(lo, boxes + 8 * list);
        store_joined<Most>(hi, boxes + 8 * list + 4);
    }
    return are_finite(doubt);
}

bool boxes_of_points(const float* x, const std::int32_t* places, int count, bool at_end,
                     BoxPack& boxes) noexcept {
    Lanes lo[3], hi[3], doubt = all(0);
    for (int axis = 0; axis < 3; ++axis) {
        lo[axis] = all(infinity);
        hi[axis] = all(-infinity);
    }
    for (int i = 0; i < 16 * count; i += 16) {
        Lanes p[3];
        if (at_end)
            for (int axis = 0; axis < 3; ++axis) p[axis] = gather(x + axis, places + i);
        else
            load_points([&](int k) { return x + places[i + k]; }, p);
        for (int axis = 0; axis < 3; ++axis) {
            lo[axis] = min(lo[axis], p[axis]);
            hi[axis] = max(hi[axis], p[axis]);
            doubt = doubt + all(0) * p[axis];
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        store(lo[axis], boxes.lo[axis]);
        store(hi[axis], boxes.hi[axis]);
    }
    return above(doubt, -1) == 0xffff;
}

void hull(const BoxPack& boxes, int count, float* box) noexcept {
    const auto some = [&](const float* p) { return load_some(p, count); };
    const Lanes lo[3] = {some(boxes.lo[0]), some(boxes.lo[1]), some(boxes.lo[2])},
                hi[3] = {some(boxes.hi[0]), some(boxes.hi[1]), some(boxes.hi[2])};
    store_joined<Least>(lo, box);
    store_joined<Most>(hi, box + 4);
}

void triangle_boxes(const float* points, const std::uint8_t* corners, BoxPack& boxes) noexcept {
    Lanes low[3], high[3];
    for (int c = 0; c < 3; ++c) {
        Lanes x[3];
        load_points([&](int k) { return points + 4 * corners[16 * c + k]; }, x);
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = c == 0 ? x[axis] : min(low[axis], x[axis]);
            high[axis] = c == 0 ? x[axis] : max(high[axis], x[axis]);
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        store(low[axis], boxes.lo[axis]);
        store(high[axis], boxes.hi[axis]);
    }
}
