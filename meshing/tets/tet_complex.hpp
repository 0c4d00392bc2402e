#pragma once

#include <array>
#include <optional>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

using Tet = std::array<int, 4>;

/// An edit of a tetrahedral mesh that fills the same region with other tetrahedra.
struct TetChange {
    std::vector<int> removed;  // tetrahedra
    std::vector<Tet> added;
    int node = -1;  // node that moves to `position`; the number of nodes: a new one; -1: none
    Eigen::RowVector3d position = Eigen::RowVector3d::Zero();
    double ratio = 0;  // least radius ratio of `added`
};

/// Tetrahedra that can be edited one neighbourhood at a time. Nodes and faces of the boundary stay.
class TetComplex {
 public:
    /// tets: every volume > 0.
    explicit TetComplex(TetMesh tets);

    int nodes() const noexcept { return X_.size(); }
    int tets() const noexcept { return T_.size(); }  // with removed ones
    bool removed(int t) const noexcept { return T_[t][0] < 0; }
    const Tet& tet(int t) const noexcept { return T_[t]; }
    /// The same tetrahedron with its corner `c` first, positively oriented.
    Tet tet_from(int t, int c) const noexcept;

    const Eigen::RowVector3d& position(int node) const noexcept { return X_[node]; }
    bool on_boundary(int node) const noexcept { return on_boundary_[node]; }

    /// Tetrahedra of a node, sorted.
    const std::vector<int>& star(int node) const noexcept { return star_[node]; }

    /// The tetrahedron that shares the face of `t` opposite to its corner `c`; -1 on the boundary.
    int neighbour(int t, int c) const;

    /// The tetrahedra around an edge of `t`, and the nodes around it: tets[i] is (a, b, ring[i], ring[i +
    /// 1]), positively oriented and cyclic. Nothing for an edge of the boundary.
    struct Ring {
        std::vector<int> tets, nodes;
    };
    std::optional<Ring> ring(int t, int a, int b) const;

    /// Radius ratio of a tetrahedron, with `moved`'s node at its position.
    double ratio(const Tet& tet, const TetChange* moved = nullptr) const;

    /// Least radius ratio of these tetrahedra.
    double least_ratio(const std::vector<int>& tets) const;

    /// Makes a change. Returns the tetrahedra that take the place of the removed ones.
    std::vector<int> apply(const TetChange& change);

    /// The mesh without the removed tetrahedra; added nodes come last.
    TetMesh mesh() const;

 private:
    void insert(int t);
    void erase(int t);

    std::vector<Eigen::RowVector3d> X_;
    std::vector<Tet> T_;  // first node -1: removed
    std::vector<char> on_boundary_;
    std::vector<std::vector<int>> star_;
};

}  // namespace nbd
