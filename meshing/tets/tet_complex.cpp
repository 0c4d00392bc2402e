#include "meshing/tets/tet_complex.hpp"

#include <algorithm>
#include <limits>

#include "meshing/tets/tet_quality.hpp"

namespace nbd {
namespace {

bool has(const Tet& tet, int node) { return std::ranges::find(tet, node) != tet.end(); }

/// Corners opposite to each corner, so that (corner, face) is positively oriented.
constexpr int face_of[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

}  // namespace

TetComplex::TetComplex(TetMesh tets) {
    X_.reserve(tets.X.rows());
    for (int v = 0; v < tets.X.rows(); ++v) X_.emplace_back(tets.X.row(v));
    T_.reserve(tets.T.rows());
    star_.resize(X_.size());
    on_boundary_.resize(X_.size());
    for (int t = 0; t < tets.T.rows(); ++t) {
        T_.push_back({tets.T(t, 0), tets.T(t, 1), tets.T(t, 2), tets.T(t, 3)});
        insert(t);
    }
    const Faces boundary = boundary_faces(tets);
    for (const int node : boundary.reshaped()) on_boundary_[node] = 1;
}

void TetComplex::insert(int t) {
    for (const int node : T_[t]) {
        auto& star = star_[node];
        star.insert(std::ranges::lower_bound(star, t), t);
    }
}

void TetComplex::erase(int t) {
    for (const int node : T_[t]) {
        auto& star = star_[node];
        star.erase(std::ranges::lower_bound(star, t));
    }
    T_[t] = {-1, -1, -1, -1};
}

Tet TetComplex::tet_from(int t, int c) const noexcept {
    const auto& face = face_of[c];
    return {T_[t][c], T_[t][face[0]], T_[t][face[1]], T_[t][face[2]]};
}

int TetComplex::neighbour(int t, int c) const {
    const auto& face = face_of[c];
    for (const int other : star_[T_[t][face[0]]])
        if (other != t && has(T_[other], T_[t][face[1]]) && has(T_[other], T_[t][face[2]])) return other;
    return -1;
}

std::optional<TetComplex::Ring> TetComplex::ring(int t, int a, int b) const {
    Ring ring;
    for (int current = t;;) {
        const Tet& tet = T_[current];
        // The corner after b, so that (a, b, from, last corner) is positively oriented.
        const auto ia = std::ranges::find(tet, a) - tet.begin(), ib = std::ranges::find(tet, b) - tet.begin();
        const auto& face = face_of[ia];
        const int k = std::ranges::find(face, ib) - face;
        const int from = face[(k + 1) % 3];
        ring.tets.push_back(current);
        ring.nodes.push_back(tet[from]);
        const int next = neighbour(current, from);
        if (next < 0) return std::nullopt;
        if (next == t) return ring;
        current = next;
    }
}

double TetComplex::ratio(const Tet& tet, const TetChange* moved) const {
    const auto at = [&](int node) -> Eigen::Vector3d {
        return (moved != nullptr && node == moved->node ? moved->position : X_[node]).transpose();
    };
    return radius_ratio(at(tet[0]), at(tet[1]), at(tet[2]), at(tet[3]));
}

double TetComplex::least_ratio(const std::vector<int>& tets) const {
    double least = std::numeric_limits<double>::infinity();
    for (const int t : tets) least = std::min(least, ratio(T_[t]));
    return least;
}

std::vector<int> TetComplex::apply(const TetChange& change) {
    for (const int t : change.removed) erase(t);
    if (change.node == nodes()) {
        X_.push_back(change.position);
        star_.emplace_back();
        on_boundary_.push_back(0);
    } else if (change.node >= 0) {
        X_[change.node] = change.position;
    }
    std::vector<int> places = change.removed;
    while (places.size() < change.added.size()) {
        places.push_back(tets());
        T_.push_back({-1, -1, -1, -1});
    }
    places.resize(change.added.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
        T_[places[i]] = change.added[i];
        insert(places[i]);
    }
    return places;
}

TetMesh TetComplex::mesh() const {
    TetMesh mesh;
    mesh.X.resize(nodes(), 3);
    for (int v = 0; v < nodes(); ++v) mesh.X.row(v) = X_[v];
    mesh.T.resize(std::ranges::count_if(T_, [](const Tet& tet) { return tet[0] >= 0; }), 4);
    int row = 0;
    for (const Tet& tet : T_)
        if (tet[0] >= 0) mesh.T.row(row++) << tet[0], tet[1], tet[2], tet[3];
    return mesh;
}

}  // namespace nbd
