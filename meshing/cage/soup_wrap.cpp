#include "meshing/cage/soup_wrap.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

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
// CGAL's one-shot function builds the tree anew for each wrap, so this uses the classes behind it. Triangles
// are not divided: large ones would cost memory without bound.
using Oracle = CGAL::Alpha_wraps_3::internal::Triangle_soup_oracle<Kernel, int, false>;
using Wrapper = CGAL::Alpha_wraps_3::internal::Alpha_wrap_3<Oracle>;

/// The triangles of the soup with area, and thin ones along the sides of the others, which CGAL would skip.
std::vector<Triangle3> solid_triangles(const TriMesh& soup) {
    const auto point = [&](int v) { return Point(soup.X(v, 0), soup.X(v, 1), soup.X(v, 2)); };
    const Eigen::RowVector3d extent = soup.X.colwise().maxCoeff() - soup.X.colwise().minCoeff();
    const double tiny = 1e-7 * extent.maxCoeff();
    std::vector<Triangle3> triangles;
    triangles.reserve(static_cast<std::size_t>(soup.F.rows()));
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

struct SoupWrap::Tree {
    Oracle oracle;
};

SoupWrap::SoupWrap(const TriMesh& soup) {
    auto tree = std::make_unique<Tree>();
    tree->oracle.add_triangle_soup(solid_triangles(soup));
    tree_ = std::move(tree);
    for (int v = 0; v < soup.X.rows(); ++v) box_.extend(soup.X.row(v).transpose());
}

SoupWrap::~SoupWrap() = default;
SoupWrap::SoupWrap(SoupWrap&&) noexcept = default;

TriMesh SoupWrap::wrap(double alpha, double offset) const {
    CGAL::Surface_mesh<Point> wrapped;
    Wrapper wrapper(tree_->oracle);
    wrapper(alpha, offset, wrapped, CGAL::parameters::default_values());
    TriMesh mesh{Nodes(static_cast<Eigen::Index>(wrapped.number_of_vertices()), 3),
                 Faces(static_cast<Eigen::Index>(wrapped.number_of_faces()), 3)};
    std::vector<int> row(wrapped.num_vertices() + wrapped.number_of_removed_vertices());
    int count = 0;
    for (const auto v : wrapped.vertices()) {
        const Point& p = wrapped.point(v);
        mesh.X.row(count) << p.x(), p.y(), p.z();
        row[static_cast<std::size_t>(v)] = count++;
    }
    count = 0;
    for (const auto f : wrapped.faces()) {
        int corner = 0;
        for (const auto v : wrapped.vertices_around_face(wrapped.halfedge(f)))
            mesh.F(count, corner++) = row[static_cast<std::size_t>(v)];
        ++count;
    }
    return mesh;
}

double SoupWrap::distance(const Eigen::Vector3d& point) const {
    return std::sqrt(tree_->oracle.squared_distance(Point(point.x(), point.y(), point.z())));
}

}  // namespace nbd
