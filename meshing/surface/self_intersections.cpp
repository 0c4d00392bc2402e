#include "meshing/surface/self_intersections.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "collision/geometry/far_origin.hpp"
#include "collision/geometry/triangle_triangle.hpp"
#include "meshing/surface/box_tree.hpp"

namespace nbd {
namespace {

using Point = Eigen::Vector3f;

bool segment_meets(const Point& a, const Point& b, const Triangle& t) {
    return triangles_intersect({a, b, b}, t);
}

bool segments_meet(const Point& a, const Point& b, const Point& c, const Point& d) {
    return triangles_intersect({a, b, b}, {c, d, d});
}

bool point_on(const Point& p, const Triangle& t) { return triangles_intersect({p, p, p}, t); }

/// Whether triangles a b c and b a d, consistently oriented, overlap beyond the edge a b. This requires that
/// they lie in one plane with c and d on the same side.
bool folded(const Point& a, const Point& b, const Point& c, const Point& d) {
    const Eigen::Vector3d A = a.cast<double>(), B = b.cast<double>();
    const Eigen::Vector3d n = (B - A).cross(c.cast<double>() - A), m = (A - B).cross(d.cast<double>() - B);
    if (n.dot(m) > -0.9 * n.norm() * m.norm()) return false;  // normals are far from opposite
    return point_on(d, {a, b, c}) || point_on(c, {a, b, d}) || segments_meet(a, d, b, c) ||
           segments_meet(b, d, a, c);
}

class FaceTest {
 public:
    explicit FaceTest(const TriMesh& mesh)
        : F_(mesh.F), X_((mesh.X.rowwise() - far_origin(mesh.X, mesh.F).transpose()).cast<float>()) {}

    bool operator()(int f, int g) const {
        int shared = 0, i = 0, j = 0;        // i, j: corners of f and g at a shared vertex
        int unshared_f = 3, unshared_g = 3;  // sums of the unshared corner numbers
        for (int k = 0; k < 3; ++k)
            for (int l = 0; l < 3; ++l)
                if (F_(f, k) == F_(g, l)) ++shared, i = k, j = l, unshared_f -= k, unshared_g -= l;
        if (shared == 0) return triangles_intersect(triangle(f), triangle(g));
        // If two faces meet outside their common vertex, they meet on a side opposite to it: the ray from the
        // vertex through a common point leaves one of the faces there.
        if (shared == 1)
            return segment_meets(at(f, i + 1), at(f, i + 2), triangle(g)) ||
                   segment_meets(at(g, j + 1), at(g, j + 2), triangle(f));
        return folded(at(f, unshared_f + 1), at(f, unshared_f + 2), at(f, unshared_f), at(g, unshared_g));
    }

 private:
    Point at(int f, int corner) const { return X_.row(F_(f, corner % 3)); }
    Triangle triangle(int f) const { return {at(f, 0), at(f, 1), at(f, 2)}; }

    const Faces& F_;
    const Vertices X_;
};

}  // namespace

std::vector<FacePair> self_intersections(const TriMesh& mesh) {
    std::vector<BoxTree::Box> boxes(mesh.F.rows());
    for (int f = 0; f < mesh.F.rows(); ++f)
        for (int c = 0; c < 3; ++c)
            boxes[f].extend(mesh.X.row(mesh.F(f, c)).cast<float>().cast<double>().transpose());
    const BoxTree tree(boxes);
    const FaceTest meet(mesh);
    std::vector<FacePair> pairs;
    for (int f = 0; f < mesh.F.rows(); ++f)
        tree.overlapping(boxes[f], [&](int g) {
            if (f < g && meet(f, g)) pairs.push_back({f, g});
        });
    std::ranges::sort(pairs);
    return pairs;
}

}  // namespace nbd
