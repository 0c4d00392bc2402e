#include "meshing/surface/solid_boundary.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <numeric>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "meshing/surface/check_surface.hpp"
#include "meshing/surface/counted.hpp"
#include "meshing/surface/edges.hpp"

namespace nbd {
namespace {

/// The edges of a surface of which each has two faces; empty for other surfaces.
std::optional<EdgeTable> closed_edges(const Faces& F) {
    for (Eigen::Index f = 0; f < F.rows(); ++f)
        if (repeats_vertex(F, f)) return {};
    EdgeTable table = edge_table(F);
    for (const EdgeTable::Edge& edge : table.edges)
        if (edge.end - edge.begin != 2) return {};
    return table;
}

/// One vertex of each part of a surface.
std::vector<int> vertex_of_each_part(const TriMesh& mesh) {
    DisjointSets parts(mesh.X.rows());
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f)
        for (int c = 1; c < 3; ++c) parts.join(mesh.F(f, c), mesh.F(f, 0));
    std::vector<int> vertices;
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) vertices.push_back(parts.root(mesh.F(f, 0)));
    std::ranges::sort(vertices);
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    return vertices;
}

/// How often the surface winds around a point: near 1 or -1 within a closed one, near 0 outside. faces: those
/// of mesh.F that count. The point must not lie on them.
double winding_number(const TriMesh& mesh, std::span<const int> faces, const Eigen::RowVector3d& point) {
    double angle = 0;
    for (const int f : faces) {
        const Eigen::RowVector3d a = mesh.X.row(mesh.F(f, 0)) - point, b = mesh.X.row(mesh.F(f, 1)) - point,
                                 c = mesh.X.row(mesh.F(f, 2)) - point;
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        angle +=
            2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return angle / (4 * std::numbers::pi);
}

}  // namespace

Containment containment(const TriMesh& inner, const TriMesh& given) {
    if (!closed_edges(given.F)) return Containment::none;
    TriMesh outer = given;
    try {
        turn_outward(outer);                  // what lies in a cavity is outside
    } catch (const std::invalid_argument&) {  // a one-sided surface has no inside
        return Containment::none;
    }
    Eigen::AlignedBox3d box;
    for (Eigen::Index v = 0; v < outer.X.rows(); ++v) box.extend(outer.X.row(v).transpose());
    std::vector<int> faces(outer.F.rows());
    std::iota(faces.begin(), faces.end(), 0);
    const std::vector<int> vertices = vertex_of_each_part(inner);
    const auto inside = std::ranges::count_if(vertices, [&](int v) {
        return box.contains(inner.X.row(v).transpose()) &&
               std::abs(winding_number(outer, faces, inner.X.row(v))) > 0.5;
    });
    if (inside == 0) return Containment::none;
    return inside == std::ssize(vertices) ? Containment::whole : Containment::some_parts;
}

namespace {

struct Component {
    std::vector<int> faces;
    Eigen::AlignedBox3d box;
    double volume = 0;  // signed, by the current orientation
    int depth = 0;      // number of other components that enclose it
};

std::vector<Component> gather(const TriMesh& mesh, const Components& components) {
    std::vector<Component> gathered(components.count);
    for (int f = 0; f < mesh.F.rows(); ++f) {
        Component& component = gathered[components.of_face[f]];
        component.faces.push_back(f);
        for (int c = 0; c < 3; ++c) component.box.extend(mesh.X.row(mesh.F(f, c)).transpose());
    }
    for (Component& component : gathered) {
        const Eigen::RowVector3d origin = component.box.center();  // near the faces, to limit cancellation
        for (const int f : component.faces) {
            const Eigen::RowVector3d a = mesh.X.row(mesh.F(f, 0)) - origin,
                                     b = mesh.X.row(mesh.F(f, 1)) - origin,
                                     c = mesh.X.row(mesh.F(f, 2)) - origin;
            component.volume += a.dot(b.cross(c)) / 6;
        }
    }
    return gathered;
}

void check_volumes(const std::vector<Component>& components) {
    for (const Component& component : components) {
        const double size = component.box.diagonal().norm();
        if (!(std::abs(component.volume) > 1e-12 * size * size * size))
            throw std::invalid_argument(
                fmt::format("the component of face {} encloses no volume", component.faces.front()));
    }
}

/// Whether the component encloses `point`, which does not lie on it.
bool contains(const TriMesh& mesh, const Component& component, const Eigen::RowVector3d& point) {
    if (!component.box.contains(point.transpose())) return false;
    return std::abs(winding_number(mesh, component.faces, point)) > 0.5;
}

void find_depths(const TriMesh& mesh, std::vector<Component>& components) {
    for (Component& inner : components)
        for (const Component& outer : components)
            if (&inner != &outer && contains(mesh, outer, mesh.X.row(mesh.F(inner.faces.front(), 0))))
                ++inner.depth;
}

void turn_components(TriMesh& mesh, std::vector<Component>& components) {
    for (Component& component : components) {
        const bool is_cavity = component.depth % 2 == 1;
        if ((component.volume < 0) == is_cavity) continue;
        for (const int f : component.faces) std::swap(mesh.F(f, 1), mesh.F(f, 2));
        component.volume = -component.volume;
    }
}

}  // namespace

std::string describe(const SurfaceReport& r) {
    std::string text =
        fmt::format("{} vertices, {} faces, {}, genus {}, area {:.6g} m2, volume {:.6g} m3", r.vertices,
                    r.faces, counted(r.shells, "shell", "shells"), r.genus, r.area, r.volume);
    if (r.cavities > 0) text += ", " + counted(r.cavities, "cavity", "cavities");
    if (r.dropped_vertices > 0)
        text += "; dropped " + counted(r.dropped_vertices, "unreferenced vertex", "unreferenced vertices");
    if (r.turned_faces > 0)
        text += r.turned_faces == r.faces ? "; turned every face: the surface was inside out"
                                          : "; turned " + counted(r.turned_faces, "face", "faces");
    if (r.first_intersection)
        text += fmt::format("; intersects itself: {}, the first between faces {} and {}",
                            counted(r.intersecting_pairs, "pair of faces", "pairs of faces"),
                            r.first_intersection->a, r.first_intersection->b);
    return text;
}

int turn_outward(TriMesh& mesh) {
    const std::optional<EdgeTable> table = closed_edges(mesh.F);
    if (!table) return 0;
    const Faces given = mesh.F;
    std::vector<Component> components = gather(mesh, make_orientations_agree(mesh.F, *table));
    find_depths(mesh, components);
    turn_components(mesh, components);
    return (mesh.F.array() != given.array()).rowwise().any().count();
}

SolidBoundary make_solid_boundary(TriMesh mesh, const SolidBoundaryConfig& config) {
    const EdgeTable table = check_surface(mesh);
    SurfaceReport report;
    report.dropped_vertices = drop_unreferenced(mesh);
    report.vertices = mesh.X.rows();
    report.edges = table.edges.size();
    report.faces = mesh.F.rows();

    const Faces given = mesh.F;
    const Components labels = make_orientations_agree(mesh.F, table);
    report.genus = labels.count - (report.vertices - report.edges + report.faces) / 2;  // Euler's formula

    const std::vector<FacePair> pairs = self_intersections(mesh);
    report.intersecting_pairs = pairs.size();
    if (!pairs.empty()) report.first_intersection = pairs.front();
    if (!pairs.empty() && !config.allow_self_intersection)
        throw std::invalid_argument(
            fmt::format("the surface intersects itself: faces {} and {} meet; {}", pairs[0].a, pairs[0].b,
                        counted(report.intersecting_pairs, "such pair", "such pairs")));

    std::vector<Component> components = gather(mesh, labels);
    check_volumes(components);
    find_depths(mesh, components);
    turn_components(mesh, components);
    for (const Component& component : components) {
        ++(component.depth % 2 == 1 ? report.cavities : report.shells);
        report.volume += component.volume;
    }
    if (report.shells > 1 && !config.allow_components) {
        const auto is_shell = [](const Component& component) { return component.depth % 2 == 0; };
        const auto first = std::ranges::find_if(components, is_shell);
        const auto second = std::find_if(std::next(first), components.end(), is_shell);
        throw std::invalid_argument(
            fmt::format("the surface has {} components ({} and {}; the second shell starts at face {}), "
                        "but a body must be one shell, with or without cavities",
                        components.size(), counted(report.shells, "shell", "shells"),
                        counted(report.cavities, "cavity", "cavities"), second->faces.front()));
    }
    report.area = area(mesh.X, mesh.F);
    for (int f = 0; f < mesh.F.rows(); ++f) report.turned_faces += mesh.F.row(f) != given.row(f);
    return {std::move(mesh), report};
}

}  // namespace nbd
