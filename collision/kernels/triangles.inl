// Tests of triangles against triangles, part of kernels.inl.

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
