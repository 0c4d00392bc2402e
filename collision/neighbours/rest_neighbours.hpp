#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "collision/base/executor.hpp"
#include "collision/geometry/face_pair_set.hpp"
#include "collision/geometry/geometry.hpp"
#include "collision/geometry/tet_mesh.hpp"
#include "collision/wide_tree/wide_tree.hpp"

namespace nbd {

/// What is known at rest of each leaf of a wide tree and the faces around it, for NeighbourProof. Does not
/// change while the surface moves; bodies of one mesh can share it. Takes some 150 bytes a face.
class RestNeighbours {
 public:
    /// Faces of a leaf.
    struct Covered {
        int leaf;
        std::uint16_t faces;  // bits
    };
    using Fit = Eigen::Matrix<double, 10, 10>;

    /// The vertices near a leaf. The faces between them are covered, except those that pass very near the
    /// leaf's.
    struct Region {
        std::span<const int> vertices;     // those of the leaf first, in its order; at most 256
        std::span<const float> points;     // [3, n] their rest positions about `centre`, over `size`
        std::span<const Covered> covered;  // ascending leaves
        /// Covered faces with corners at these points are no nearer to the leaf's than this, except pairs
        /// that have a common vertex or are left out. Metres.
        double distance;
        double longest_edge;     // of the covered faces and the leaf's, metres
        Eigen::Vector3d centre;  // of the box around the vertices at rest, metres
        double size;             // half the longest side of that box, metres
        Eigen::Vector3d half;    // half its sides, over `size`
        const Fit& fit;          // inverse of the normal matrix of a LocalMap's fit
    };

    /// X: rest positions [n, 3], metres, finite; F: faces; tree: over F, must outlive this object. left_out:
    /// pairs that need no proof, because the queries leave them out; null: none. left_out_distance: all other
    /// pairs without a common vertex are farther apart than this at rest, metres, finite, >= 0. radius: how
    /// far along edges a region reaches beyond its leaf, metres, finite, >= 0. Throws std::invalid_argument
    /// on a number out of range, a tree that is not over these faces, or pairs of another surface.
    RestNeighbours(const Nodes& X, FacesRef F, const WideTree& tree,
                   std::shared_ptr<const FacePairSet> left_out, double left_out_distance, double radius,
                   const Executor& run = run_in_order);

    const WideTree& tree() const noexcept { return *tree_; }
    const std::shared_ptr<const FacePairSet>& left_out() const noexcept { return left_out_; }
    Region region(int leaf) const noexcept;
    /// Bits of the faces of leaf `other` that the region of `leaf` covers.
    unsigned covered(int leaf, int other) const noexcept;

 private:
    struct Leaf {
        std::size_t vertices = 0, covered = 0;  // where its lists begin
        double distance = 0, longest_edge = 0, size = 1;
        Eigen::Vector3d centre = Eigen::Vector3d::Zero(), half = Eigen::Vector3d::Zero();
        Fit fit = Fit::Zero();
    };
    void place_leaf(int leaf, const Nodes& X);
    void fit_leaf(int leaf);

    const WideTree* tree_;
    std::shared_ptr<const FacePairSet> left_out_;
    std::vector<Leaf> leaves_;  // [leaves + 1]
    std::vector<int> vertices_;
    std::vector<float> points_;  // three for each of vertices_
    std::vector<Covered> covered_;
};

}  // namespace nbd
