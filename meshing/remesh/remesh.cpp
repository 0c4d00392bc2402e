#include "meshing/remesh/remesh.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Surface_mesh.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <vector>

#include "meshing/surface/shells.hpp"

namespace nbd {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

Mesh to_cgal(const TriMesh& surface) {
    Mesh mesh;
    std::vector<Mesh::Vertex_index> vertices;
    for (const auto& x : surface.X.rowwise())
        vertices.push_back(mesh.add_vertex(Kernel::Point_3(x[0], x[1], x[2])));
    for (const auto& f : surface.F.rowwise()) mesh.add_face(vertices[f[0]], vertices[f[1]], vertices[f[2]]);
    return mesh;
}

TriMesh from_cgal(Mesh& mesh) {
    mesh.collect_garbage();
    TriMesh surface{Nodes(mesh.number_of_vertices(), 3), Faces(mesh.number_of_faces(), 3)};
    for (const auto v : mesh.vertices()) {
        const Kernel::Point_3& p = mesh.point(v);
        surface.X.row(v.idx()) << p.x(), p.y(), p.z();
    }
    int count = 0;
    for (const auto f : mesh.faces()) {
        int corner = 0;
        for (const auto v : mesh.vertices_around_face(mesh.halfedge(f)))
            surface.F(count, corner++) = static_cast<int>(v.idx());
        ++count;
    }
    return surface;
}

/// Twice the areas of faces, times their normals.
Nodes face_normals(const TriMesh& s) {
    Nodes normals(s.F.rows(), 3);
    for (Eigen::Index f = 0; f < s.F.rows(); ++f) {
        const Eigen::RowVector3d a = s.X.row(s.F(f, 0));
        normals.row(f) = (s.X.row(s.F(f, 1)) - a).cross(s.X.row(s.F(f, 2)) - a);
    }
    return normals;
}

/// Moves all vertices outward by one distance, until the volume is as wanted.
void reach_volume(TriMesh& surface, double wanted) {
    constexpr int rounds = 3;  // of Newton's iteration
    for (int k = 0; k < rounds; ++k) {
        const Nodes of_faces = face_normals(surface);
        Nodes normals = Nodes::Zero(surface.X.rows(), 3);
        for (Eigen::Index f = 0; f < surface.F.rows(); ++f)
            for (const int v : surface.F.row(f)) normals.row(v) += of_faces.row(f);
        const Nodes units = normals.rowwise().normalized();
        // The volume grows by a third of the area around each vertex, times its way along the normal there.
        const double growth = normals.cwiseProduct(units).sum() / 6;
        surface.X += (wanted - enclosed_volume(surface)) / growth * units;
    }
}

}  // namespace

double enclosed_volume(const TriMesh& surface) {
    const Eigen::RowVector3d middle = surface.X.colwise().mean();
    double sum = 0;
    for (const auto& f : surface.F.rowwise()) {
        const Eigen::RowVector3d a = surface.X.row(f[0]) - middle, b = surface.X.row(f[1]) - middle,
                                 c = surface.X.row(f[2]) - middle;
        sum += a.cross(b).dot(c) / 6;
    }
    return sum;
}

double remeshed_faces(const TriMesh& surface, double edge) {
    return area(surface.X, surface.F) / (std::sqrt(3) / 4 * edge * edge);
}

namespace {

/// Of one shell; empty where triangles with such edges do not follow it.
std::optional<TriMesh> remeshed_shell(const TriMesh& surface, double edge) {
    constexpr double sharp = 50;  // degrees
    namespace pmp = CGAL::Polygon_mesh_processing;
    Mesh mesh = to_cgal(surface);
    auto is_sharp = mesh.add_property_map<Mesh::Edge_index, bool>("e:is_sharp", false).first;
    pmp::detect_sharp_edges(mesh, sharp, is_sharp);
    // Sharp edges keep their places: relaxed along them, the tips where they end would be lost.
    pmp::isotropic_remeshing(mesh.faces(), edge, mesh,
                             CGAL::parameters::number_of_iterations(5)
                                 .number_of_relaxation_steps(3)
                                 .edge_is_constrained_map(is_sharp)
                                 .relax_constraints(false));
    TriMesh result = from_cgal(mesh);
    constexpr double least_volume = 0.5;  // of the surface's, where triangles still follow its shape
    const double wanted = enclosed_volume(surface);
    if (result.F.rows() < 4 || !(enclosed_volume(result) / wanted > least_volume)) return {};
    reach_volume(result, wanted);
    return result;
}

void append(TriMesh& mesh, const TriMesh& more) {
    const Eigen::Index vertices = mesh.X.rows(), faces = mesh.F.rows();
    mesh.X.conservativeResize(vertices + more.X.rows(), 3);
    mesh.X.bottomRows(more.X.rows()) = more.X;
    mesh.F.conservativeResize(faces + more.F.rows(), 3);
    mesh.F.bottomRows(more.F.rows()) = more.F.array() + static_cast<int>(vertices);
}

}  // namespace

TriMesh remesh(const TriMesh& surface, double edge) {
    if (!(edge > 0) || !std::isfinite(edge))
        throw std::invalid_argument(fmt::format("an edge of {} m; allowed: more than 0", edge));
    TriMesh result{Nodes(0, 3), Faces(0, 3)};
    for (const Shell& shell : shells_of(surface.X, surface.F)) {
        const TriMesh part = part_of(surface.X, surface.F, shell.faces);
        const std::optional<TriMesh> covered = remeshed_shell(part, edge);
        if (!covered && shell.volume > 0)
            throw std::invalid_argument(
                fmt::format("triangles with edges of {:.3g} m do not follow the surface", edge));
        append(result, covered ? *covered : part);
    }
    return result;
}

}  // namespace nbd
