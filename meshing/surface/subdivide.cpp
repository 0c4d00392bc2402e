#include "meshing/surface/subdivide.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <queue>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "meshing/surface/check_surface.hpp"
#include "meshing/surface/edges.hpp"

namespace nbd {
namespace {

using Weights = std::vector<Eigen::Triplet<double>>;

void keep_vertices(int vertex_count, Weights& weights) {
    for (int v = 0; v < vertex_count; ++v) weights.emplace_back(v, v, 1);
}

void average_vertices(int vertex_count, const EdgeTable& table, Weights& weights) {
    std::vector<int> valence(vertex_count, 0);
    for (const EdgeTable::Edge& edge : table.edges) ++valence[edge.a], ++valence[edge.b];
    const auto neighbour_weight = [&](int v) {
        const int n = valence[v];
        const double c = 3. / 8 + std::cos(2 * std::numbers::pi / n) / 4;
        return (5. / 8 - c * c) / n;
    };
    for (int v = 0; v < vertex_count; ++v) {
        const int n = valence[v];
        weights.emplace_back(v, v, n == 0 ? 1 : 1 - n * neighbour_weight(v));
    }
    for (const EdgeTable::Edge& edge : table.edges) {
        weights.emplace_back(edge.a, edge.b, neighbour_weight(edge.a));
        weights.emplace_back(edge.b, edge.a, neighbour_weight(edge.b));
    }
}

/// The corner of the half-edge's face that is not on the edge.
int opposite(const Faces& F, int halfedge) { return F(halfedge / 3, (halfedge + 2) % 3); }

Embedding step_weights(const Faces& F, int vertex_count, const EdgeTable& table, SubdivisionScheme scheme) {
    Weights weights;
    const int edge_count = table.edges.size();
    weights.reserve(vertex_count + 6 * table.edges.size());
    if (scheme == SubdivisionScheme::midpoint)
        keep_vertices(vertex_count, weights);
    else
        average_vertices(vertex_count, table, weights);
    for (int e = 0; e < edge_count; ++e) {
        const EdgeTable::Edge& edge = table.edges[e];
        const bool smooth = scheme == SubdivisionScheme::loop;
        for (const int end : {edge.a, edge.b})
            weights.emplace_back(vertex_count + e, end, smooth ? 3. / 8 : 1. / 2);
        if (!smooth) continue;
        for (const int h : table.at(edge)) weights.emplace_back(vertex_count + e, opposite(F, h), 1. / 8);
    }
    Embedding S(vertex_count + edge_count, vertex_count);
    S.setFromTriplets(weights.begin(), weights.end());
    return S;
}

Faces split_faces(const Faces& F, int vertex_count, const EdgeTable& table) {
    Faces fine(F.rows() * 4, 3);
    for (int f = 0; f < F.rows(); ++f) {
        const auto middle = [&](int k) { return vertex_count + table.edge_of[3 * f + k]; };
        const int a = F(f, 0), b = F(f, 1), c = F(f, 2), ab = middle(0), bc = middle(1), ca = middle(2);
        fine.middleRows(4 * f, 4) << a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca;
    }
    return fine;
}

}  // namespace

Subdivision subdivide(const TriMesh& coarse, SubdivisionScheme scheme, int levels) {
    if (levels < 0 || levels > 4)
        throw std::invalid_argument("subdivision by " + std::to_string(levels) + " levels; allowed: 0 to 4");
    const int coarse_count = coarse.X.rows();
    Subdivision result{coarse, Embedding(coarse_count, coarse_count)};
    result.S.setIdentity();
    EdgeTable table = check_surface(coarse);
    for (int level = 0; level < levels; ++level) {
        if (level > 0) table = edge_table(result.mesh.F);
        const int vertex_count = result.S.rows();
        result.S = (step_weights(result.mesh.F, vertex_count, table, scheme) * result.S).eval();
        result.mesh.F = split_faces(result.mesh.F, vertex_count, table);
    }
    result.mesh.X = result.S * coarse.X;
    return result;
}

namespace {

class Divider {
 public:
    Divider(const TriMesh& surface, int vertices) {
        X_.resize(std::max<Eigen::Index>(vertices, surface.X.rows()), 3);
        X_.topRows(surface.X.rows()) = surface.X;
        count_ = surface.X.rows();
        for (int f = 0; f < surface.F.rows(); ++f)
            add({surface.F(f, 0), surface.F(f, 1), surface.F(f, 2)}, f);
    }

    void divide_longest() {
        const auto [length, a, b] = longest_.top();
        longest_.pop();
        const int middle = count_++;
        X_.row(middle) = (X_.row(a) + X_.row(b)) / 2;
        for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, a}}) {
            const int f = face_of_.at({from, to});
            std::array<int, 3> face = faces_[f];
            while (face[0] != from) std::rotate(face.begin(), face.begin() + 1, face.end());
            face_of_.erase({from, to});
            add({from, middle, face[2]}, f);
            add({middle, to, face[2]}, faces_.size());
        }
    }

    int count() const noexcept { return count_; }

    TriMesh mesh() const {
        TriMesh mesh{X_.topRows(count_), Faces(faces_.size(), 3)};
        for (std::size_t f = 0; f < faces_.size(); ++f)
            for (int c = 0; c < 3; ++c) mesh.F(f, c) = faces_[f][c];
        return mesh;
    }

 private:
    /// Puts a face at row f of the faces. Edges without an entry yet are queued once.
    void add(const std::array<int, 3>& face, int f) {
        if (f == std::ssize(faces_)) faces_.emplace_back();
        faces_[f] = face;
        for (std::size_t c = 0; c < 3; ++c) {
            const int from = face[c], to = face[(c + 1) % 3];
            const bool is_new = face_of_.insert_or_assign({from, to}, f).second;
            if (is_new && !face_of_.contains({to, from}))
                longest_.emplace((X_.row(from) - X_.row(to)).squaredNorm(), std::min(from, to),
                                 std::max(from, to));
        }
    }

    Nodes X_;
    int count_ = 0;
    std::vector<std::array<int, 3>> faces_;
    std::map<std::pair<int, int>, int> face_of_;  // by directed edge
    std::priority_queue<std::tuple<double, int, int>> longest_;
};

}  // namespace

TriMesh divide_longest_edges(const TriMesh& surface, int vertices) {
    Divider divider(surface, vertices);
    while (divider.count() < vertices) divider.divide_longest();
    return divider.mesh();
}

}  // namespace nbd
