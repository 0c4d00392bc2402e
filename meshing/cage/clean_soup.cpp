#include "meshing/cage/clean_soup.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <stdexcept>
#include <vector>

#include "meshing/surface/counted.hpp"
#include "meshing/surface/edges.hpp"

namespace nbd {
namespace {

bool has_area(const TriMesh& mesh, int f) {
    const Eigen::RowVector3d a = mesh.X.row(mesh.F(f, 0)), b = mesh.X.row(mesh.F(f, 1)),
                             c = mesh.X.row(mesh.F(f, 2));
    return !(b - a).cross(c - a).isZero(0);
}

/// Faces with the vertices of another face; one of each group does not count.
int count_duplicates(const Faces& F) {
    std::vector<std::array<int, 3>> keys;
    keys.reserve(F.rows());
    for (int f = 0; f < F.rows(); ++f) keys.push_back(sorted_corners(F, f));
    std::ranges::sort(keys);
    return keys.end() - std::unique(keys.begin(), keys.end());
}

/// The report of a surface whose indices are in range.
SoupReport defects_of(const TriMesh& soup) {
    SoupReport report;
    report.vertices = soup.X.rows();
    report.faces = soup.F.rows();
    Faces proper(soup.F.rows(), 3);
    int kept = 0;
    for (int f = 0; f < soup.F.rows(); ++f) {
        if (repeats_vertex(soup.F, f)) continue;
        proper.row(kept++) = soup.F.row(f);
        report.flat_faces += !has_area(soup, f);
    }
    report.repeating_faces = report.faces - kept;
    report.duplicate_faces = count_duplicates(soup.F);
    const EdgeTable table = edge_table(proper.topRows(kept));
    DisjointSets sets(kept);
    for (const EdgeTable::Edge& edge : table.edges) {
        const auto halfedges = table.at(edge);
        report.open_edges += halfedges.size() == 1;
        report.crowded_edges += halfedges.size() > 2;
        for (const int h : halfedges) sets.join(halfedges[0] / 3, h / 3);
    }
    report.shells = sets.count();
    return report;
}

/// Drops faces that repeat a vertex: they have no area, and their edges seem to belong to too many faces.
void drop_repeating_faces(Faces& F) {
    int kept = 0;
    for (int f = 0; f < F.rows(); ++f)
        if (!repeats_vertex(F, f)) F.row(kept++) = F.row(f).eval();
    F.conservativeResize(kept, 3);
}

void check_extent(const TriMesh& soup) {
    const Eigen::RowVector3d least = soup.X.colwise().minCoeff(), most = soup.X.colwise().maxCoeff();
    const double side = (most - least).maxCoeff(),
                 far = std::max(least.cwiseAbs().maxCoeff(), most.cwiseAbs().maxCoeff());
    // Positions are float32 numbers: a smaller surface so far out has no shape.
    if (!(side > 1e-5 * far))
        throw std::invalid_argument(fmt::format(
            "the surface has a longest side of {:.3g} m at up to {:.3g} m from the origin; allowed: "
            "more than 1e-5 of that distance",
            side, far));
}

}  // namespace

std::string describe(const SoupReport& r) {
    std::string text = fmt::format("surface: {} vertices, {} faces, {}", r.vertices, r.faces,
                                   counted(r.shells, "shell", "shells"));
    const auto add = [&](int count, const char* one, const char* many) {
        if (count > 0) text += "; " + counted(count, one, many);
    };
    add(r.repeating_faces, "face repeats a vertex", "faces repeat a vertex");
    add(r.flat_faces, "face has no area", "faces have no area");
    add(r.duplicate_faces, "duplicate face", "duplicate faces");
    add(r.open_edges, "open edge", "open edges");
    add(r.crowded_edges, "edge of more than two faces", "edges of more than two faces");
    if (r.repeating_faces > 0) text += "; dropped the faces that repeat a vertex";
    if (r.dropped_vertices > 0)
        text += "; dropped " + counted(r.dropped_vertices, "unreferenced vertex", "unreferenced vertices");
    return text;
}

SoupReport clean_soup(TriMesh& soup) {
    check_arrays(soup);
    SoupReport report = defects_of(soup);
    drop_repeating_faces(soup.F);
    if (soup.F.rows() == 0)
        throw std::invalid_argument(fmt::format("all faces repeat a vertex ({})", report.faces));
    report.dropped_vertices = drop_unreferenced(soup);
    check_extent(soup);
    return report;
}

}  // namespace nbd
