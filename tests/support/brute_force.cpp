#include "tests/support/brute_force.hpp"

#include <algorithm>

#include "collision/geometry/closest_points.hpp"
#include "collision/geometry/triangle_triangle.hpp"

namespace nbd::test {
namespace {

/// Face pairs for which touch(Triangle, Triangle) holds, sorted by (a, b).
template <class Touch>
std::vector<FacePair> brute_force_pairs(const VerticesRef& xa, const FacesRef& fa, const VerticesRef& xb,
                                        const FacesRef& fb, const Touch& touch) {
    std::vector<FacePair> pairs;
    for (int i = 0; i < fa.rows(); ++i) {
        const Triangle s = face_triangle(xa, fa, i);
        for (int j = 0; j < fb.rows(); ++j)
            if (touch(s, face_triangle(xb, fb, j))) pairs.push_back({i, j});
    }
    return pairs;
}

}  // namespace

Triangle face_triangle(const VerticesRef& x, const FacesRef& F, Eigen::Index f) {
    return {x.row(F(f, 0)), x.row(F(f, 1)), x.row(F(f, 2))};
}

std::vector<FacePair> brute_force_intersecting(const VerticesRef& xa, const FacesRef& fa,
                                               const VerticesRef& xb, const FacesRef& fb) {
    return brute_force_pairs(xa, fa, xb, fb, triangles_intersect);
}

std::vector<FacePair> sorted(std::span<const FacePair> pairs) {
    std::vector<FacePair> result(pairs.begin(), pairs.end());
    std::ranges::sort(result);
    return result;
}

std::vector<FacePair> brute_force_within(const VerticesRef& xa, const FacesRef& fa, const VerticesRef& xb,
                                         const FacesRef& fb, float distance) {
    return brute_force_pairs(xa, fa, xb, fb, [&](const Triangle& s, const Triangle& t) {
        return triangle_distance(s, t) <= double{distance};
    });
}

BruteForceClosest brute_force_closest(const VerticesRef& xa, const FacesRef& fa, const VerticesRef& xb,
                                      const FacesRef& fb) {
    BruteForceClosest best;
    for (int i = 0; i < fa.rows(); ++i)
        for (int j = 0; j < fb.rows(); ++j) {
            const double distance = triangle_distance(face_triangle(xa, fa, i), face_triangle(xb, fb, j));
            if (distance < best.distance) best = {{i, j}, distance};
        }
    return best;
}

}  // namespace nbd::test
