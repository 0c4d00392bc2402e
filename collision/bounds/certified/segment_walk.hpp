#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "collision/geometry/tet_mesh.hpp"

namespace nbd {

/// Walks along straight segments from tetrahedron to tetrahedron in the rest pose.
class SegmentWalk {
 public:
    /// solid: valid by check_solid(); must outlive this object.
    explicit SegmentWalk(const TetMesh& solid);

    /// A piece of a segment inside one tetrahedron.
    struct Piece {
        int tet = 0;
        double share = 0;  // share of the segment's length
    };

    /// Whether the segment from p to q stays inside the solid, except for gaps shorter than 1e-9 of its
    /// length. May be false for a segment that stays inside but meets an edge or a corner. homes: tetrahedra
    /// whose closure contains p. pieces: output, the segment's pieces if the result is true.
    bool inside(const Eigen::Vector3d& p, const Eigen::Vector3d& q, std::span<const int> homes,
                std::vector<Piece>& pieces) const;

 private:
    /// The part of the segment inside a tetrahedron: parameters in [0, 1], and the corner opposite the face
    /// through which it leaves, -1 if it ends inside.
    struct Crossing {
        double in = 0, out = 1;
        int exit = -1;
    };
    Crossing crossing(int tet, const Eigen::Vector3d& p, const Eigen::Vector3d& q) const;
    bool walk(int tet, const Eigen::Vector3d& p, const Eigen::Vector3d& q, std::vector<Piece>& pieces) const;

    const TetMesh* solid_;
    std::vector<Eigen::Matrix3d> inverse_;       // [T] inverse of the matrix of edges from the first corner
    std::vector<std::array<int, 4>> neighbour_;  // [T] neighbour across the face opposite each corner, or -1
};

}  // namespace nbd
