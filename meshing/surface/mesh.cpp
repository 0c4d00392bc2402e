#include "meshing/surface/mesh.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

namespace nbd {

std::string place(const TriMesh& mesh, Eigen::Index vertex) {
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", mesh.X(vertex, 0), mesh.X(vertex, 1), mesh.X(vertex, 2));
}

void check_arrays(const TriMesh& mesh) {
    if (mesh.F.rows() == 0) throw std::invalid_argument("the surface has no faces");
    for (Eigen::Index v = 0; v < mesh.X.rows(); ++v)
        if (!mesh.X.row(v).allFinite())
            throw std::invalid_argument(fmt::format("vertex {} is not finite: {}", v, place(mesh, v)));
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f)
        for (const int v : mesh.F.row(f))
            if (v < 0 || v >= mesh.X.rows())
                throw std::invalid_argument(fmt::format(
                    "face {} refers to vertex {}, but the surface has {} vertices", f, v, mesh.X.rows()));
}

std::array<int, 3> sorted_corners(const Faces& F, Eigen::Index f) noexcept {
    std::array<int, 3> corners = {F(f, 0), F(f, 1), F(f, 2)};
    std::ranges::sort(corners);
    return corners;
}

double volume(const TetMesh& tets, Eigen::Index t) {
    const Eigen::RowVector3d a = tets.X.row(tets.T(t, 0)), b = tets.X.row(tets.T(t, 1)) - a,
                             c = tets.X.row(tets.T(t, 2)) - a;
    return b.cross(c).dot(tets.X.row(tets.T(t, 3)) - a) / 6;
}

double area(NodesRef X, FacesRef F) {
    double sum = 0;
    for (Eigen::Index f = 0; f < F.rows(); ++f) {
        const Eigen::RowVector3d a = X.row(F(f, 0));
        sum += (X.row(F(f, 1)) - a).cross(X.row(F(f, 2)) - a).norm() / 2;
    }
    return sum;
}

Faces boundary_faces(const TetMesh& tets) {
    // The faces of a positively oriented tetrahedron a b c d, counter-clockwise seen from outside.
    static constexpr int corners[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    using Key = std::array<int, 3>;
    std::vector<std::pair<Key, int>> sides;  // sorted corners, 4 * tet + local face
    sides.reserve(4 * tets.T.rows());
    for (int t = 0; t < tets.T.rows(); ++t)
        for (int k = 0; k < 4; ++k) {
            Key key = {tets.T(t, corners[k][0]), tets.T(t, corners[k][1]), tets.T(t, corners[k][2])};
            std::ranges::sort(key);
            sides.emplace_back(key, 4 * t + k);
        }
    std::ranges::sort(sides);
    std::vector<int> outer;
    for (std::size_t i = 0; i < sides.size();) {
        std::size_t j = i + 1;
        while (j < sides.size() && sides[j].first == sides[i].first) ++j;
        if (j == i + 1) outer.push_back(sides[i].second);
        i = j;
    }
    std::ranges::sort(outer);
    Faces F(outer.size(), 3);
    for (std::size_t i = 0; i < outer.size(); ++i)
        for (int c = 0; c < 3; ++c) F(i, c) = tets.T(outer[i] / 4, corners[outer[i] % 4][c]);
    return F;
}

int drop_unreferenced(TriMesh& mesh) {
    std::vector<int> number(mesh.X.rows(), -1);
    for (int f = 0; f < mesh.F.rows(); ++f)
        for (int c = 0; c < 3; ++c) number[mesh.F(f, c)] = 0;
    int kept = 0;
    for (int v = 0; v < mesh.X.rows(); ++v) {
        if (number[v] < 0) continue;
        number[v] = kept;
        mesh.X.row(kept++) = mesh.X.row(v).eval();
    }
    const int dropped = mesh.X.rows() - kept;
    mesh.X.conservativeResize(kept, 3);
    for (int f = 0; f < mesh.F.rows(); ++f)
        for (int c = 0; c < 3; ++c) mesh.F(f, c) = number[mesh.F(f, c)];
    return dropped;
}

namespace {

/// squared: lengths of the edges.
double gap_of_face(std::array<double, 3> squared) {
    std::ranges::sort(squared);
    const auto [a, b, c] = squared;
    if (!(a > 0)) return std::sqrt(c) / 2;
    if (a + b <= c) {
        // The farthest point lies on the longest edge, as far from one of its ends as from the obtuse corner.
        const double at_shorter = a * std::sqrt(c) / (a + c - b), at_longer = b * std::sqrt(c) / (b + c - a);
        return std::max(at_shorter, at_longer);
    }
    const double sixteen_areas = 2 * (a * b + b * c + c * a) - (a * a + b * b + c * c);  // squared
    const double most = c / 3;  // of acute faces; what rounding leaves of a sliver's area may be anything
    return std::sqrt(sixteen_areas > 0 ? std::min(a * b * c / sixteen_areas, most) : most);
}

}  // namespace

double vertex_gap(const TriMesh& mesh) {
    double largest = 0;
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
        const auto edge = [&](int i, int j) {
            return (mesh.X.row(mesh.F(f, i)) - mesh.X.row(mesh.F(f, j))).squaredNorm();
        };
        largest = std::max(largest, gap_of_face({edge(0, 1), edge(1, 2), edge(2, 0)}));
    }
    return largest;
}

namespace {

double squared_distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                   const Eigen::Vector3d& b) {
    const Eigen::Vector3d ab = b - a;
    const double length = ab.squaredNorm();
    const double s = length > 0 ? std::clamp((p - a).dot(ab) / length, 0., 1.) : 0;
    return (a + s * ab - p).squaredNorm();
}

}  // namespace

double squared_distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) noexcept {
    const Eigen::Vector3d n = (b - a).cross(c - a);
    const auto inside = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
        return n.cross(to - from).dot(p - from) >= 0;
    };
    if (n.squaredNorm() > 0 && inside(a, b) && inside(b, c) && inside(c, a)) {
        const double height = n.dot(p - a);
        return height * height / n.squaredNorm();
    }
    return std::min({squared_distance_to_segment(p, a, b), squared_distance_to_segment(p, b, c),
                     squared_distance_to_segment(p, c, a)});
}

}  // namespace nbd
