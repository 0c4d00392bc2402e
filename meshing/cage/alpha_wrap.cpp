#include "meshing/cage/alpha_wrap.hpp"

#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>
#if __has_include(<CGAL/AABB_traits_3.h>)  // CGAL 6
#include <CGAL/AABB_traits_3.h>
#include <CGAL/AABB_triangle_primitive_3.h>
#else
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_triangle_primitive.h>
#endif

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace nbd {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Triangle3 = Kernel::Triangle_3;
using Triangles = std::vector<Triangle3>;
#if __has_include(<CGAL/AABB_traits_3.h>)
using Traits =
    CGAL::AABB_traits_3<Kernel, CGAL::AABB_triangle_primitive_3<Kernel, Triangles::const_iterator>>;
#else
using Traits = CGAL::AABB_traits<Kernel, CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>>;
#endif

/// The triangles of the soup with area, and thin ones along the sides of the others, which CGAL would skip.
Triangles solid_triangles(const TriMesh& soup) {
    const auto point = [&](int v) { return Point(soup.X(v, 0), soup.X(v, 1), soup.X(v, 2)); };
    const Eigen::RowVector3d extent = soup.X.colwise().maxCoeff() - soup.X.colwise().minCoeff();
    const double tiny = 1e-7 * extent.maxCoeff();
    Triangles triangles;
    triangles.reserve(soup.F.rows());
    for (int f = 0; f < soup.F.rows(); ++f) {
        const std::array<Point, 3> corners = {point(soup.F(f, 0)), point(soup.F(f, 1)), point(soup.F(f, 2))};
        const Triangle3 triangle(corners[0], corners[1], corners[2]);
        if (!triangle.is_degenerate()) {
            triangles.push_back(triangle);
            continue;
        }
        for (std::size_t c = 0; c < 3; ++c)
            for (int axis = 0; axis < 3; ++axis) {
                const Kernel::Vector_3 aside(axis == 0 ? tiny : 0, axis == 1 ? tiny : 0,
                                             axis == 2 ? tiny : 0);
                const Triangle3 thin(corners[c], corners[(c + 1) % 3], corners[c] + aside);
                if (!thin.is_degenerate()) triangles.push_back(thin);
            }
    }
    return triangles;
}

}  // namespace

struct AlphaWrap::Soup {
    explicit Soup(Triangles solid) : triangles(std::move(solid)), tree(triangles.begin(), triangles.end()) {
        tree.build();
        for (const Triangle3& triangle : triangles) {
            const std::size_t n = corners.size();
            faces.push_back({n, n + 1, n + 2});
            for (int c = 0; c < 3; ++c) corners.push_back(triangle[c]);
        }
    }

    Triangles triangles;
    CGAL::AABB_tree<Traits> tree;
    std::vector<Point> corners;  // of the triangles, one after the other
    std::vector<std::array<std::size_t, 3>> faces;
};

AlphaWrap::AlphaWrap(const TriMesh& soup) : soup_(std::make_unique<const Soup>(solid_triangles(soup))) {
    for (int v = 0; v < soup.X.rows(); ++v) box_.extend(soup.X.row(v).transpose());
}

AlphaWrap::~AlphaWrap() = default;
AlphaWrap::AlphaWrap(AlphaWrap&&) noexcept = default;

TriMesh AlphaWrap::wrap(double alpha, double offset) const {
    CGAL::Surface_mesh<Point> wrapped;
    CGAL::alpha_wrap_3(soup_->corners, soup_->faces, alpha, offset, wrapped);
    TriMesh mesh{Nodes(wrapped.number_of_vertices(), 3), Faces(wrapped.number_of_faces(), 3)};
    std::vector<int> row(wrapped.num_vertices() + wrapped.number_of_removed_vertices());
    int count = 0;
    for (const auto v : wrapped.vertices()) {
        const Point& p = wrapped.point(v);
        mesh.X.row(count) << p.x(), p.y(), p.z();
        row[v] = count++;
    }
    count = 0;
    for (const auto f : wrapped.faces()) {
        int corner = 0;
        for (const auto v : wrapped.vertices_around_face(wrapped.halfedge(f)))
            mesh.F(count, corner++) = row[v];
        ++count;
    }
    return mesh;
}

double AlphaWrap::distance(const Eigen::Vector3d& point) const {
    return std::sqrt(soup_->tree.squared_distance(Point(point.x(), point.y(), point.z())));
}

}  // namespace nbd
