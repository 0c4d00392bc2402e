#include "meshing/surface/weld.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "meshing/surface/box_tree.hpp"
#include "meshing/surface/counted.hpp"
#include "meshing/surface/edges.hpp"

namespace nbd {

std::size_t PositionIndex::Hash::operator()(const Key& key) const noexcept {
    std::uint64_t h = 0x9e3779b97f4a7c15ull;
    for (const std::uint64_t k : key) {
        h = (h ^ k) * 0xff51afd7ed558ccdull;
        h ^= h >> 32;
    }
    return h;
}

PositionIndex::Key PositionIndex::key(const Eigen::RowVector3d& x) noexcept {
    const auto bits = [](double v) { return std::bit_cast<std::uint64_t>(v == 0 ? 0. : v); };
    return {bits(x[0]), bits(x[1]), bits(x[2])};
}

int PositionIndex::insert(const Eigen::RowVector3d& x) {
    return numbers_.try_emplace(key(x), size()).first->second;
}

int PositionIndex::find(const Eigen::RowVector3d& x) const noexcept {
    const auto found = numbers_.find(key(x));
    return found == numbers_.end() ? -1 : found->second;
}

TriMesh weld(const TriMesh& mesh) {
    PositionIndex index;
    std::vector<int> number(mesh.X.rows());
    TriMesh welded{Nodes(mesh.X.rows(), 3), Faces(mesh.F.rows(), 3)};
    for (int v = 0; v < mesh.X.rows(); ++v) {
        const int before = index.size(), n = index.insert(mesh.X.row(v));
        number[v] = n;
        if (n == before) welded.X.row(n) = mesh.X.row(v);
    }
    welded.X.conservativeResize(index.size(), 3);
    for (int f = 0; f < mesh.F.rows(); ++f)
        for (int c = 0; c < 3; ++c) welded.F(f, c) = number[mesh.F(f, c)];
    return welded;
}

namespace {

BoxTree::Box box_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    BoxTree::Box box(a);
    box.extend(b);
    return box;
}

/// For each vertex the one that it merges with: itself, or the first vertex within `length` of it that stays.
std::vector<int> merge(const Nodes& X, double length) {
    std::vector<BoxTree::Box> boxes;
    for (int v = 0; v < X.rows(); ++v) boxes.emplace_back(Eigen::Vector3d(X.row(v).transpose()));
    const BoxTree tree(std::move(boxes));
    std::vector<int> target(X.rows(), -1);
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(length);
    for (int v = 0; v < X.rows(); ++v) {
        if (target[v] >= 0) continue;
        target[v] = v;
        const Eigen::Vector3d x = X.row(v);
        tree.overlapping(box_of(x - reach, x + reach), [&](int other) {
            if (int& taken = target[other]; taken < 0 && (X.row(other).transpose() - x).norm() <= length)
                taken = v;
        });
    }
    return target;
}

/// A vertex on an open edge, by its share of the edge.
using OnEdge = std::pair<double, int>;

/// The open vertices on the half-edge h, in order.
std::vector<OnEdge> on_edge(const TriMesh& mesh, int h, const BoxTree& tree, const std::vector<int>& open,
                            double length) {
    const int a = mesh.F(h / 3, h % 3), b = mesh.F(h / 3, (h % 3 + 1) % 3);
    const Eigen::Vector3d from = mesh.X.row(a), along = mesh.X.row(b).transpose() - from;
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(length);
    std::vector<OnEdge> found;
    tree.overlapping(box_of(from.cwiseMin(from + along) - reach, from.cwiseMax(from + along) + reach),
                     [&](int i) {
                         const int v = open[i];
                         if (v == a || v == b || v == mesh.F(h / 3, (h % 3 + 2) % 3)) return;
                         const Eigen::Vector3d d = mesh.X.row(v).transpose() - from;
                         const double share = d.dot(along) / along.squaredNorm();
                         if (share > 0 && share < 1 && (d - share * along).norm() <= length)
                             found.emplace_back(share, v);
                     });
    std::ranges::sort(found);
    return found;
}

/// Divides one open edge of each face that has vertices on it. Returns how many edges it divided.
int split_once(TriMesh& mesh, double length) {
    const EdgeTable table = edge_table(mesh.F);
    std::vector<int> halfedges, open;
    for (const EdgeTable::Edge& edge : table.edges) {
        if (edge.end - edge.begin != 1) continue;
        halfedges.push_back(table.halfedges[edge.begin]);
        open.insert(open.end(), {edge.a, edge.b});
    }
    std::ranges::sort(open);
    open.erase(std::unique(open.begin(), open.end()), open.end());
    std::ranges::sort(halfedges);
    std::vector<BoxTree::Box> boxes;
    for (const int v : open) boxes.emplace_back(Eigen::Vector3d(mesh.X.row(v).transpose()));
    const BoxTree tree(std::move(boxes));
    std::vector<std::array<int, 3>> added;
    int splits = 0, last_face = -1;
    for (const int h : halfedges) {
        const int f = h / 3, k = h % 3;
        if (f == last_face) continue;
        const std::vector<OnEdge> vertices = on_edge(mesh, h, tree, open, length);
        if (vertices.empty()) continue;
        last_face = f;
        ++splits;
        const int b = mesh.F(f, (k + 1) % 3), c = mesh.F(f, (k + 2) % 3);
        mesh.F(f, (k + 1) % 3) = vertices.front().second;
        for (std::size_t i = 0; i < vertices.size(); ++i)
            added.push_back({vertices[i].second, i + 1 < vertices.size() ? vertices[i + 1].second : b, c});
    }
    const Eigen::Index before = mesh.F.rows();
    mesh.F.conservativeResize(before + added.size(), 3);
    for (std::size_t i = 0; i < added.size(); ++i)
        mesh.F.row(before + i) << added[i][0], added[i][1], added[i][2];
    return splits;
}

}  // namespace

std::string describe(const WeldReport& r) {
    return fmt::format("welded within {:.3g} m: {} merged, {} divided, {} dropped", r.length,
                       counted(r.merged_vertices, "vertex", "vertices"),
                       counted(r.split_edges, "open edge", "open edges"),
                       counted(r.dropped_faces, "collapsed face", "collapsed faces"));
}

TriMesh weld_within(const TriMesh& mesh, double length, WeldReport& report) {
    if (!(length > 0 && std::isfinite(length)))
        throw std::invalid_argument(fmt::format("cannot weld within {} m; allowed: more than 0", length));
    report = {.length = length};
    const std::vector<int> target = merge(mesh.X, length);
    TriMesh welded{mesh.X, Faces(mesh.F.rows(), 3)};
    std::vector<int> row(target.size(), -1);
    int count = 0;
    for (std::size_t v = 0; v < target.size(); ++v) {
        if (target[v] != static_cast<int>(v)) {
            ++report.merged_vertices;
            continue;
        }
        welded.X.row(count) = mesh.X.row(v);
        row[v] = count++;
    }
    welded.X.conservativeResize(count, 3);
    int faces = 0;
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
        for (int c = 0; c < 3; ++c) welded.F(faces, c) = row[target[mesh.F(f, c)]];
        ++(repeats_vertex(welded.F, faces) ? report.dropped_faces : faces);
    }
    welded.F.conservativeResize(faces, 3);
    // Each round divides at most one edge of a face, so three rounds serve the faces of the file: the edges
    // that are new are not open. More rounds are for parts that a tolerant `length` makes divisible again.
    constexpr int most_rounds = 8;
    for (int round = 0; round < most_rounds; ++round) {
        const int splits = split_once(welded, length);
        report.split_edges += splits;
        if (splits == 0) break;
    }
    return welded;
}

}  // namespace nbd
