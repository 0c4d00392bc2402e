#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

/// Walks along straight segments from tetrahedron to tetrahedron, at rest.
class SegmentWalk {
 public:
    /// solid: checked; referred to.
    explicit SegmentWalk(const TetMesh& solid);

    /// A piece of a segment inside one tetrahedron.
    struct Piece {
        int tet = 0;
        double share = 0;  // of the segment's length
    };

    /// Whether the segment from p to q stays inside the solid, but for gaps of less than 1e-9 of its length.
    /// May say no where it just does (it meets an edge or a corner). homes: tetrahedra whose closure holds p.
    /// pieces: out, the way where the answer is yes.
    bool inside(const Eigen::Vector3d& p, const Eigen::Vector3d& q, std::span<const int> homes,
                std::vector<Piece>& pieces) const;

 private:
    /// Where the segment is inside a tetrahedron: parameters in [0, 1], and the face that it leaves by (the
    /// corner across), -1 where it ends inside.
    struct Crossing {
        double in = 0, out = 1;
        int exit = -1;
    };
    Crossing crossing(int tet, const Eigen::Vector3d& p, const Eigen::Vector3d& q) const;
    bool walk(int tet, const Eigen::Vector3d& p, const Eigen::Vector3d& q, std::vector<Piece>& pieces) const;

    const TetMesh* solid_;
    std::vector<Eigen::Matrix3d> inverse_;       // [T] of the edges from the first corner, as columns
    std::vector<std::array<int, 4>> neighbour_;  // [T] across the face that faces each corner, or -1
};

}  // namespace nbd
