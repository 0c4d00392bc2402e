#include "meshing/surface/material_fill.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "collision/base/stop.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "meshing/surface/box_tree.hpp"
#include "meshing/surface/quadratic_tets.hpp"

namespace nbd {
namespace {

/// Where a line passes into (1) or out of (-1) a face, seen from below.
struct Crossing {
    double height;
    int turn;
};

/// A closed surface, of which lines along the axes find the inside.
class Solid {
 public:
    explicit Solid(const TriMesh& surface) : surface_(surface), tree_(boxes_of(surface)) {}

    /// The axis that the faces near a box look along the most; -1 if there are none.
    int main_axis(const Eigen::AlignedBox3d& box) const {
        Eigen::Vector3d areas = Eigen::Vector3d::Zero();
        bool is_near = false;
        tree_.overlapping(box, [&](int f) {
            is_near = true;
            areas += (corner(f, 1) - corner(f, 0)).cross(corner(f, 2) - corner(f, 0)).cwiseAbs();
        });
        int axis = -1;
        if (is_near) areas.maxCoeff(&axis);
        return axis;
    }

    /// The crossings below a height of the line along an axis through `point`, by height.
    void crossings(int axis, const Eigen::Vector3d& point, double highest,
                   std::vector<Crossing>& found) const {
        found.clear();
        Eigen::AlignedBox3d line(point, point);
        line.min()[axis] = -std::numeric_limits<double>::infinity();
        line.max()[axis] = highest;
        tree_.overlapping(line, [&](int f) {
            if (const int turn = turn_of(f, axis, point); turn != 0) {
                const Eigen::Vector3d a = corner(f, 0), n = (corner(f, 1) - a).cross(corner(f, 2) - a);
                // The height at which the plane of the face holds the line.
                double height = a[axis];
                if (n[axis] != 0)
                    for (const int side : {(axis + 1) % 3, (axis + 2) % 3})
                        height -= n[side] * (point[side] - a[side]) / n[axis];
                const auto [lowest, top] =
                    std::minmax({corner(f, 0)[axis], corner(f, 1)[axis], corner(f, 2)[axis]});
                height = std::clamp(height, lowest, top);  // of a face along the line, rounding could be all
                if (height <= highest) found.push_back({height, turn});
            }
        });
        std::ranges::sort(found, {}, [](const Crossing& c) { return std::pair(c.height, -c.turn); });
    }

 private:
    static std::vector<BoxTree::Box> boxes_of(const TriMesh& surface) {
        std::vector<BoxTree::Box> boxes(surface.F.rows());
        for (std::size_t f = 0; f < boxes.size(); ++f)
            for (const int v : surface.F.row(f)) boxes[f].extend(surface.X.row(v).transpose());
        return boxes;
    }

    Eigen::Vector3d corner(int f, int k) const { return surface_.X.row(surface_.F(f, k)); }

    /// Whether the line passes into (1) or out of (-1) the solid through a face, or beside it (0). A line
    /// through an edge counts for one of its faces: sides are told from sorted vertices, and none is zero.
    int turn_of(int f, int axis, const Eigen::Vector3d& point) const {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        const auto is_left = [&](int from, int to) {
            const bool swap = from > to;
            if (swap) std::swap(from, to);
            const auto a = surface_.X.row(from), b = surface_.X.row(to);
            const double side = (b[u] - a[u]) * (point[v] - a[v]) - (b[v] - a[v]) * (point[u] - a[u]);
            return (side >= 0) != swap;
        };
        const auto F = surface_.F.row(f);
        const bool first = is_left(F[0], F[1]);
        if (first != is_left(F[1], F[2]) || first != is_left(F[2], F[0])) return 0;
        return first ? -1 : 1;  // counterclockwise from above: its outside is above
    }

    const TriMesh& surface_;
    BoxTree tree_;
};

using Moments = Eigen::Matrix4d;  // means of z z^T with barycentric coordinates z

/// A tetrahedron with lines through it along an axis.
class LinesOfTet {
 public:
    LinesOfTet(const Eigen::Matrix<double, 4, 3>& corners, int axis) : corners_(corners), axis_(axis) {
        slope_.bottomRows<3>() = (corners.bottomRows<3>().rowwise() - corners.row(0)).transpose().inverse();
        slope_.row(0) = -slope_.bottomRows<3>().colwise().sum();
    }

    /// Means of z z^T over the material, by so many lines through a rectangle around the tetrahedron, of
    /// which about a third pass through it; empty if no line passes through the tetrahedron, or if all of it
    /// is material or none.
    std::optional<Moments> moments(const Solid& solid, int lines) const {
        const Eigen::RowVector3d low = corners_.colwise().minCoeff(), high = corners_.colwise().maxCoeff();
        Moments inside = Moments::Zero();
        double whole = 0, filled = 0;
        std::vector<Crossing> crossings;
        for (int line = 0; line < lines; ++line) {
            // A sequence of low discrepancy, so that no face is parallel to rows of lines.
            Eigen::Vector3d point = low;
            const auto at = [&](double step) { return std::fmod(0.5 + step * (line + 1), 1.0); };
            point[(axis_ + 1) % 3] += at(0.7548776662466927) * (high - low)[(axis_ + 1) % 3];
            point[(axis_ + 2) % 3] += at(0.5698402909980532) * (high - low)[(axis_ + 2) % 3];
            const auto [from, to] = span_of(point);
            if (!(to > from)) continue;
            whole += to - from;
            solid.crossings(axis_, point, to, crossings);
            int winding = 0;
            double start = from;
            for (const Crossing& crossing : crossings) {
                const double end = std::max(crossing.height, from);
                if (winding != 0) filled += add(point, start, end, inside);
                start = end;
                winding += crossing.turn;
            }
            if (winding != 0) filled += add(point, start, to, inside);
        }
        constexpr double rounding = 1e-9;
        if (filled <= rounding * whole || filled >= (1 - rounding) * whole) return {};
        return inside / inside.sum() * (filled / whole);
    }

 private:
    /// The heights between which the line through a point lies in the tetrahedron.
    std::pair<double, double> span_of(Eigen::Vector3d point) const {
        double from = corners_.col(axis_).minCoeff(), to = corners_.col(axis_).maxCoeff();
        point[axis_] = 0;
        const Eigen::Vector4d z = coordinates(point);
        for (int a = 0; a < 4; ++a) {
            const double grows = slope_(a, axis_);
            if (grows > 0) from = std::max(from, -z[a] / grows);
            if (grows < 0) to = std::min(to, -z[a] / grows);
            if (grows == 0 && z[a] < 0) to = from;
        }
        return {from, to};
    }

    Eigen::Vector4d coordinates(const Eigen::Vector3d& point) const {
        Eigen::Vector4d z = slope_ * (point - corners_.row(0).transpose());
        z[0] += 1;
        return z;
    }

    /// Adds the integral of z z^T along a piece of the line, and returns its length.
    double add(Eigen::Vector3d point, double from, double to, Moments& sum) const {
        if (!(to > from)) return 0;
        point[axis_] = (from + to) / 2;
        const Eigen::Vector4d middle = coordinates(point), half = slope_.col(axis_) * (to - from) / 2;
        sum += (to - from) * (middle * middle.transpose() + half * half.transpose() / 3);
        return to - from;
    }

    Eigen::Matrix<double, 4, 3> corners_;
    int axis_;
    Eigen::Matrix<double, 4, 3> slope_;  // of the barycentric coordinates
};

}  // namespace

Eigen::Matrix4d coordinate_products(const Eigen::Matrix<double, 1, 10>& fill) {
    Eigen::Matrix4d S;
    for (int a = 0; a < 4; ++a) S(a, a) = fill[a];
    for (int k = 0; k < 6; ++k) {
        const auto [a, b] = edges_of_tet[k];
        S(a, b) = S(b, a) = fill[4 + k] / 2;
    }
    return S;
}

Eigen::Matrix<double, 1, 10> fill_of_products(const Eigen::Matrix4d& S) {
    Eigen::Matrix<double, 1, 10> fill;
    for (int a = 0; a < 4; ++a) fill[a] = S(a, a);
    for (int k = 0; k < 6; ++k) fill[4 + k] = 2 * S(edges_of_tet[k].first, edges_of_tet[k].second);
    return fill;
}

TetFill material_fill(const TetMesh& tets, const TriMesh& surface) {
    constexpr double beside = 1e-5;  // counted of what is not material
    // Errors of many tetrahedra are means of each other's.
    const int lines =
        std::clamp(static_cast<int>(4'000'000 / std::max<Eigen::Index>(1, tets.T.rows())), 300, 2400);
    const Moments full = (Moments::Identity() + Moments::Ones()) / 20;
    stop_if_asked();
    const Solid solid(surface);
    TetFill fill(tets.T.rows(), 10);
    parallel_for(
        static_cast<int>(tets.T.rows()),
        [&](int t) {
            Eigen::Matrix<double, 4, 3> corners;
            Eigen::AlignedBox3d box;
            for (int k = 0; k < 4; ++k) {
                corners.row(k) = tets.X.row(tets.T(t, k));
                box.extend(corners.row(k).transpose());
            }
            std::optional<Moments> in_part;
            if (const int axis = solid.main_axis(box); axis >= 0)
                in_part = LinesOfTet(corners, axis).moments(solid, lines);
            Moments S = in_part.value_or(Moments::Zero());
            if (!in_part) {
                const Eigen::Vector3d middle = corners.colwise().mean().transpose();
                std::vector<Crossing> below;
                solid.crossings(0, middle, middle.x(), below);
                int winding = 0;
                for (const Crossing& crossing : below) winding += crossing.turn;
                if (winding != 0) S = full;
            }
            S = (1 - beside) * S + beside * full;
            fill.row(t) = fill_of_products(S);
        },
        8);
    return fill;
}

}  // namespace nbd
