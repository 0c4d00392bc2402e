#include "meshing/surface/check_surface.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <utility>

#include "collision/geometry/far_origin.hpp"
#include "collision/geometry/triangle_triangle.hpp"
#include "meshing/surface/box_tree.hpp"
#include "meshing/surface/counted.hpp"

namespace nbd {
namespace {

template <class Error = std::invalid_argument, class... Args>
[[noreturn]] void fail(fmt::format_string<Args...> text, Args&&... args) {
    throw Error(fmt::format(text, std::forward<Args>(args)...));
}

void check_size(const TriMesh& mesh) {
    constexpr double most = 1e30;  // metres, which single precision knows
    for (int v = 0; v < mesh.X.rows(); ++v)
        if (mesh.X.row(v).cwiseAbs().maxCoeff() > most)
            fail("vertex {} is farther away than {:g} m: {}", v, most, place(mesh, v));
}

bool has_area(const TriMesh& mesh, int f) {
    constexpr double least_height = 1e-7;  // relative to the longest side: a few float32 steps
    const Eigen::RowVector3d a = mesh.X.row(mesh.F(f, 0)), b = mesh.X.row(mesh.F(f, 1)),
                             c = mesh.X.row(mesh.F(f, 2));
    const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    return (b - a).cross(c - a).norm() > least_height * longest;
}

void check_faces(const TriMesh& mesh) {
    std::vector<int> repeating, flat;
    for (int f = 0; f < mesh.F.rows(); ++f) {
        if (repeats_vertex(mesh.F, f))
            repeating.push_back(f);
        else if (!has_area(mesh, f))
            flat.push_back(f);
    }
    const auto corners = [&](int f) {
        return fmt::format("{} {} {}", mesh.F(f, 0), mesh.F(f, 1), mesh.F(f, 2));
    };
    if (!repeating.empty())
        fail("face {} repeats a vertex ({}, at {}); {}", repeating[0], corners(repeating[0]),
             place(mesh, mesh.F(repeating[0], 0)), counted(repeating.size(), "such face", "such faces"));
    if (!flat.empty())
        fail("face {} has no area (vertices {}, at {}); {}", flat[0], corners(flat[0]),
             place(mesh, mesh.F(flat[0], 0)), counted(flat.size(), "such face", "such faces"));
}

void check_duplicates(const TriMesh& mesh) {
    std::vector<std::pair<std::array<int, 3>, int>> keyed;  // sorted corners, face
    keyed.reserve(mesh.F.rows());
    for (int f = 0; f < mesh.F.rows(); ++f) keyed.emplace_back(sorted_corners(mesh.F, f), f);
    std::ranges::sort(keyed);
    std::vector<std::pair<int, int>> repeats;  // face, earlier face
    for (std::size_t i = 1; i < keyed.size(); ++i)
        if (keyed[i].first == keyed[i - 1].first) repeats.emplace_back(keyed[i].second, keyed[i - 1].second);
    if (repeats.empty()) return;
    const auto [face, earlier] = *std::ranges::min_element(repeats);
    fail("face {} has the same vertices as face {}; {}", face, earlier,
         counted(repeats.size(), "duplicate face", "duplicate faces"));
}

void check_edges(const TriMesh& mesh, const EdgeTable& table) {
    std::vector<const EdgeTable::Edge*> open, crowded;
    for (const EdgeTable::Edge& edge : table.edges) {
        if (edge.end - edge.begin == 1) open.push_back(&edge);
        if (edge.end - edge.begin > 2) crowded.push_back(&edge);
    }
    if (!crowded.empty()) {
        const EdgeTable::Edge& edge = *crowded[0];
        const auto halfedges = table.at(edge);
        fail<SurfaceNotClosed>(
            "edge {}-{} at {} belongs to {} faces ({}, {}, {}{}), but an edge of a solid has 2; {}", edge.a,
            edge.b, place(mesh, edge.a), halfedges.size(), halfedges[0] / 3, halfedges[1] / 3,
            halfedges[2] / 3, halfedges.size() > 3 ? ", ..." : "",
            counted(crowded.size(), "such edge", "such edges"));
    }
    if (!open.empty())
        fail<SurfaceNotClosed>("the surface is open: edge {}-{} at {} belongs only to face {}; {}",
                               open[0]->a, open[0]->b, place(mesh, open[0]->a), table.at(*open[0])[0] / 3,
                               counted(open.size(), "open edge", "open edges"));
}

/// Walks around each vertex from face to face across shared edges. One walk must visit all faces of the
/// vertex.
void check_vertices(const TriMesh& mesh, const EdgeTable& table) {
    const int corner_count = 3 * mesh.F.rows();
    std::vector<char> walked(corner_count, 0);
    std::vector<int> first_face(mesh.X.rows(), -1);
    int vertex = -1, face = -1, other_face = -1;
    std::size_t count = 0;
    for (int start = 0; start < corner_count; ++start) {
        if (walked[start]) continue;
        const int v = mesh.F(start / 3, start % 3);
        int& first = first_face[v];
        if (first < 0) {
            first = start / 3;
        } else if (count++ == 0) {
            vertex = v, face = first, other_face = start / 3;
        }
        int corner = start, side = start;  // `side`: half-edge of the corner's face by which to leave
        do {
            walked[corner] = 1;
            const int next = table.twin(side), f = next / 3;
            int k = 0;
            while (mesh.F(f, k) != v) ++k;
            corner = 3 * f + k;
            // The face has two sides at v; this is the one the walk did not enter by.
            side = next == corner ? 3 * f + (k + 2) % 3 : corner;
        } while (corner != start);
    }
    if (count > 0)
        fail("vertex {} at {} is not manifold: the parts around it at faces {} and {} meet only there; {}",
             vertex, place(mesh, vertex), face, other_face, counted(count, "such joint", "such joints"));
}

}  // namespace

EdgeTable check_surface(const TriMesh& mesh) {
    check_arrays(mesh);
    check_size(mesh);
    check_faces(mesh);
    check_duplicates(mesh);
    EdgeTable table = edge_table(mesh.F);
    check_edges(mesh, table);
    check_vertices(mesh, table);
    return table;
}

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
