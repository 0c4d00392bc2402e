#include "meshing/surface/soup_report.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

#include "meshing/surface/counted.hpp"
#include "meshing/surface/edges.hpp"

namespace nbd {
namespace {

bool repeats_vertex(const Faces& F, int f) {
    return F(f, 0) == F(f, 1) || F(f, 1) == F(f, 2) || F(f, 2) == F(f, 0);
}

bool has_area(const TriMesh& mesh, int f) {
    const Eigen::RowVector3d a = mesh.X.row(mesh.F(f, 0)), b = mesh.X.row(mesh.F(f, 1)),
                             c = mesh.X.row(mesh.F(f, 2));
    return !(b - a).cross(c - a).isZero(0);
}

/// Faces with the vertices of another face; one of each group does not count.
int count_duplicates(const Faces& F) {
    std::vector<std::array<int, 3>> keys;
    keys.reserve(F.rows());
    for (int f = 0; f < F.rows(); ++f) {
        keys.push_back({F(f, 0), F(f, 1), F(f, 2)});
        std::ranges::sort(keys.back());
    }
    std::ranges::sort(keys);
    return std::ranges::unique(keys).size();
}

/// Sets of faces, merged edge by edge.
class FaceSets {
 public:
    explicit FaceSets(int faces) : parent_(faces), count_(faces) {
        std::iota(parent_.begin(), parent_.end(), 0);
    }
    void join(int a, int b) {
        a = root(a), b = root(b);
        if (a != b) parent_[std::max(a, b)] = std::min(a, b), --count_;
    }
    int count() const noexcept { return count_; }

 private:
    int root(int f) {
        while (parent_[f] != f) {
            int& parent = parent_[f];
            f = parent = parent_[parent];
        }
        return f;
    }
    std::vector<int> parent_;
    int count_;
};

}  // namespace

SoupReport soup_report(const TriMesh& soup) {
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
    FaceSets sets(kept);
    for (const EdgeTable::Edge& edge : table.edges) {
        const auto halfedges = table.at(edge);
        report.open_edges += halfedges.size() == 1;
        report.crowded_edges += halfedges.size() > 2;
        for (const int h : halfedges) sets.join(halfedges[0] / 3, h / 3);
    }
    report.shells = sets.count();
    return report;
}

std::string describe(const SoupReport& r) {
    std::string text =
        fmt::format("{} vertices, {} faces, {}", r.vertices, r.faces, counted(r.shells, "shell", "shells"));
    const auto add = [&](int count, const char* one, const char* many) {
        if (count > 0) text += "; " + counted(count, one, many);
    };
    add(r.repeating_faces, "face repeats a vertex", "faces repeat a vertex");
    add(r.flat_faces, "face has no area", "faces have no area");
    add(r.duplicate_faces, "duplicate face", "duplicate faces");
    add(r.open_edges, "open edge", "open edges");
    add(r.crowded_edges, "edge of more than two faces", "edges of more than two faces");
    return text;
}

}  // namespace nbd
