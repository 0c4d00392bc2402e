#include "apps/bench/exactness/swept_pairs.hpp"

#include <algorithm>

#include "collision/geometry/closest_points.hpp"
#include "collision/geometry/triangle_triangle.hpp"

namespace nbd {
namespace {

struct FaceBox {
    Eigen::Array3d lo, hi;
    int face;
};

Triangle triangle(const VerticesRef& x, const FacesRef& F, int f) {
    return {x.row(F(f, 0)), x.row(F(f, 1)), x.row(F(f, 2))};
}

/// Boxes of all faces, sorted along the first axis. Each is grown by half of `by`, exactly or a little more.
std::vector<FaceBox> sorted_boxes(const VerticesRef& x, const FacesRef& F, double by) {
    std::vector<FaceBox> boxes;
    boxes.reserve(F.rows());
    for (int f = 0; f < F.rows(); ++f) {
        const auto corner = [&](int k) { return x.row(F(f, k)).cast<double>().transpose().array().eval(); };
        const Eigen::Array3d a = corner(0), b = corner(1), c = corner(2);
        boxes.push_back({a.min(b).min(c) - by, a.max(b).max(c) + by, f});
    }
    std::ranges::sort(boxes, {}, [](const FaceBox& box) { return box.lo[0]; });
    return boxes;
}

}  // namespace

std::vector<FacePair> swept_pairs(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb, float distance) {
    const double by = 0.5000001 * double{distance};  // sides of far boxes round
    const std::vector<FaceBox> a = sorted_boxes(xa, fa, by), b = sorted_boxes(xb, fb, by);
    std::vector<FacePair> pairs;
    const auto compare = [&](const FaceBox& s, const FaceBox& t) {
        if ((s.lo > t.hi).any() || (t.lo > s.hi).any()) return;
        const Triangle p = triangle(xa, fa, s.face), q = triangle(xb, fb, t.face);
        if (distance == 0 ? triangles_intersect(p, q) : triangle_distance(p, q) <= double{distance})
            pairs.push_back({s.face, t.face});
    };
    // Each pair is compared once: when the box that begins later is not yet passed.
    for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
        if (a[i].lo[0] <= b[j].lo[0]) {
            for (std::size_t k = j; k < b.size() && b[k].lo[0] <= a[i].hi[0]; ++k) compare(a[i], b[k]);
            ++i;
        } else {
            for (std::size_t k = i; k < a.size() && a[k].lo[0] <= b[j].hi[0]; ++k) compare(a[k], b[j]);
            ++j;
        }
    }
    std::ranges::sort(pairs);
    return pairs;
}

}  // namespace nbd
