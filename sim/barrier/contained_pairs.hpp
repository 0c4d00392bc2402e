#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <span>
#include <vector>

#include "collision/geometry/tet_mesh.hpp"
#include "collision/wide_tree/wide_walk.hpp"
#include "sim/patches/contact_shape.hpp"

namespace nbd {

/// Pairs of leaves of a surface's tree that are near at rest and lie deep enough within the tetrahedra that
/// carry them: no straight way between two of their vertices leaves these, or passes into tetrahedra that are
/// not joined to theirs by faces. Such vertices x at rest and y in a
/// pose have y1 - y2 = G (x1 - x2), where G is a mean of deformation gradients along the way. With F, the
/// gradient in the middle of both leaves, and d, by how much the others around differ from it, points of two
/// faces, which are means of corners, have |y1 - y2| >= s |x1 - x2| - d D: s is the least stretch of F, and D
/// the largest distance at rest of corners of the two faces.
class ContainedPairs {
 public:
    /// tets, rest: nodes and vertices at rest; quadratic, or nothing is contained. near: pairs of leaves,
    /// a <= b.
    ContainedPairs(const ContactShape& shape, const TetMesh& tets, const Nodes& rest, const WideTree& tree,
                   std::span<const LeafPair> near);

    /// [near] whether the pair is contained.
    const std::vector<char>& is_contained() const noexcept { return is_contained_; }

    /// Appends the pairs of whose faces it is not proved that they keep a share of their distance at rest all
    /// along a motion. begin, end: positions of the nodes, [N, 3].
    void prove(const Nodes& begin, const Nodes& end, double share, std::vector<LeafPair>& open) const;

 private:
    /// Some pairs: one, those of a leaf, or those of a block of leaves.
    struct Group {
        Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // of the box around their vertices
        double radius = 0;                                 // of the ball around it
        double ratio = 0;                                  // D over the distance of the faces, at most
        int tet = -1;               // whose F is compared with: of a pair, that which holds the centre
        std::vector<int> others{};  // through which ways go, too, ascending
        int begin = 0, end = 0;     // its pairs, or the groups of the level below
    };
    enum Level { of_pair, of_leaf, of_block, levels };
    /// F at rest position X: at_centre + sum_k slopes[k] (X - centre)_k.
    struct Field {
        Eigen::Matrix3d at_centre;
        std::array<Eigen::Matrix3d, 3> slopes;
        double steepness = 0;  // at least the norm of the change of F over the way

        Eigen::Matrix3d at(const Eigen::Vector3d& from_centre) const {
            return at_centre + from_centre[0] * slopes[0] + from_centre[1] * slopes[1] +
                   from_centre[2] * slopes[2];
        }
    };
    struct Tet {
        Eigen::Vector3d centre;
        double radius = 0;                   // of the ball around it
        Eigen::Matrix<double, 4, 3> slopes;  // of its barycentric coordinates
        Eigen::Vector4d coordinates(const Eigen::Vector3d& X) const {
            return (slopes * (X - centre)).array() + 0.25;
        }
    };
    struct Search;  // at rest

    void gather(Level level, const std::function<int(int)>& parent_of);
    Field field(int tet, const Nodes& x) const;
    bool is_proved(const Group& group, std::span<const Field> begin, std::span<const Field> end,
                   double share) const;

    Tets corner_tets_;
    std::vector<Eigen::Matrix3d> inverse_edges_;  // [corner tets]
    std::vector<Tet> tets_;
    std::vector<LeafPair> pairs_;  // that are contained, ascending
    std::array<std::vector<Group>, levels> groups_;
    std::vector<char> is_contained_;
};

}  // namespace nbd
