// The kernels of affine bounds, part of kernels.inl.

inline float magnitude(float x) noexcept { return x < 0 ? -x : x; }

/// Why `slack` suffices, with u = 2^-24, o the origin, y the nodes relative to o, and for each axis
/// M = |o| + max |y| + |t| + sum over m of |A_m| reach_m; K is the largest number of weights of a vertex and
/// e the largest error of their sum. The identity of Kernels::affine_map holds for any A and t, so only the
/// evaluation counts. A node differs from o + y by at most u max |y|. Rounding A r + t and subtracting it
/// from y costs at most 5.01 u M. A vertex in float, a sum of K products, is off by at most 1.02 K u M, and
/// weights whose sum is off add at most 2.1 e M. Centre and sides of a child cost 4.01 u M and 5.01 u M, and
/// 2 u M for being float32 themselves, and the last three sums, of terms of at most 4 M together, 12 u M. All
/// of it is below ((32 + 2 K) u + 3 (e + v)) M; 2^-100 covers underflow. An oriented box has none of the last
/// three sums, but two that make its centre and margin, at most 16 u M, and those of Slab; twice the slack
/// covers all.
inline Lanes slack(float rounding, const Lanes& far) noexcept { return all(rounding) * far + all(0x1p-100f); }

/// An affine map, the same in every lane.
struct AffineMap {
    Lanes A[3][3], t[3];

    /// products: sums of y r^T over nodes. moments: see AffinePart.
    AffineMap(const Lanes (&products)[3][3], const Lanes (&sums)[3], const AffinePart& part) noexcept {
        const auto moment = [&](int i) { return all(part.moments[i]); };
        const Lanes xx = moment(0), xy = moment(1), xz = moment(2), yy = moment(3), yz = moment(4),
                    zz = moment(5);
        for (int a = 0; a < 3; ++a) {
            const Lanes x = all(sum(products[a][0])), y = all(sum(products[a][1])),
                        z = all(sum(products[a][2]));
            A[a][0] = x * xx + y * xy + z * xz;
            A[a][1] = x * xy + y * yy + z * yz;
            A[a][2] = x * xz + y * yz + z * zz;
            t[a] = all(sum(sums[a]) / static_cast<float>(part.count));
        }
    }
    Lanes linear(int a, const Lanes& x, const Lanes& y, const Lanes& z) const noexcept {
        return A[a][0] * x + A[a][1] * y + A[a][2] * z;
    }
    Lanes linear(int a, const float (&v)[3][16]) const noexcept {
        return linear(a, load(v[0]), load(v[1]), load(v[2]));
    }
    /// Boxes of children. low, high: least and greatest d of their carriers. far: M without the map's part.
    void box(int a, const RestBoxes& rest, const float* reach, float origin, const Lanes& low,
             const Lanes& high, float far, float rounding, BoxPack& boxes,
             OrientedBoxes* oriented) const noexcept {
        const Lanes all_far = all(far) + abs(t[a]) + abs(A[a][0]) * all(reach[0]) +
                              abs(A[a][1]) * all(reach[1]) + abs(A[a][2]) * all(reach[2]);
        const Lanes centre = linear(a, rest.centre) + (t[a] + all(origin));
        const Lanes side[3] = {linear(a, rest.side[0]), linear(a, rest.side[1]), linear(a, rest.side[2])};
        const Lanes half = abs(side[0]) + abs(side[1]) + abs(side[2]);
        const Lanes by = slack(rounding, all_far);
        // Where numbers overflow, NaN becomes infinity: boxes are joined, and a minimum may lose NaN.
        store(max(centre - half + (low - by), all(-infinity)), boxes.lo[a]);
        store(min(centre + half + (high + by), all(infinity)), boxes.hi[a]);
        if (!oriented) return;
        store(centre + (low + high) * all(0.5f), oriented->centre[a]);
        for (int s = 0; s < 3; ++s) store(side[s], oriented->side[s][a]);
        store((high - low) * all(0.5f) + (by + by), oriented->margin[a]);
    }
};

/// Writes the nodes of a part relative to the first one, all x, then all y, then all z.
inline void relative_nodes(const AffinePart& part, const float* nodes, float* y) noexcept {
    const float* origin = nodes + part.nodes[0];
    for (int i = 0; i < part.count; i += 16) {
        Lanes x[3];
        if (part.at_end)
            for (int a = 0; a < 3; ++a) x[a] = gather(nodes + a, part.nodes + i);
        else
            load_points([&](int k) { return nodes + part.nodes[i + k]; }, x);
        for (int a = 0; a < 3; ++a) store(x[a] - all(origin[a]), y + a * part.count + i);
    }
}

void affine_map(const AffinePart& part, const RestBoxes& rest, const float* nodes, float rounding,
                float* scratch, BoxPack& boxes, OrientedBoxes* oriented) noexcept {
    const int count = part.count;
    const float* origin = nodes + part.nodes[0];
    relative_nodes(part, nodes, scratch);
    const auto rest_at = [&](int a, int i) { return load_shorts(part.rest + a * count + i); };
    Lanes products[3][3], sums[3], farthest[3];
    for (int a = 0; a < 3; ++a) {
        sums[a] = farthest[a] = all(0);
        for (int m = 0; m < 3; ++m) products[a][m] = all(0);
    }
    for (int i = 0; i < count; i += 16) {
        const Lanes r[3] = {rest_at(0, i), rest_at(1, i), rest_at(2, i)};
        for (int a = 0; a < 3; ++a) {
            const Lanes y = load(scratch + a * count + i);
            for (int m = 0; m < 3; ++m) products[a][m] = products[a][m] + y * r[m];
            sums[a] = sums[a] + y;
            farthest[a] = max(abs(y), farthest[a]);
        }
    }
    const AffineMap map(products, sums, part);
    for (int i = 0; i < count; i += 16) {
        const Lanes r[3] = {rest_at(0, i), rest_at(1, i), rest_at(2, i)};
        for (int a = 0; a < 3; ++a) {
            float* y = scratch + a * count + i;
            store(load(y) - (map.linear(a, r[0], r[1], r[2]) + map.t[a]), y);
        }
    }
    float most[4];
    store_joined<Most>(farthest, most);
    for (int a = 0; a < 3; ++a) {
        Lanes low = all(infinity), high = all(-infinity);
        for (int c = 0; c < part.carriers; ++c) {
            const Lanes left = pick(scratch + a * count, count, part.carrier + 16 * c);
            low = min(left, low);
            high = max(left, high);
        }
        map.box(a, rest, part.reach, origin[a], low, high, magnitude(origin[a]) + most[a], rounding, boxes,
                oriented);
    }
    if (oriented) find_slabs(*oriented);
}
