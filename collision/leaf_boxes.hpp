#pragma once

#include <cstdint>
#include <vector>

#include "collision/collision_tree.hpp"
#include "collision/face_boxes.hpp"
#include "collision/positions.hpp"

namespace nbd {

/// A small box tree under every leaf of a sphere tree, refitted as a whole when its leaf is first visited
/// in a pose. Its nodes halve the leaf's range of faces again and again, down to `leaf_faces`:
/// build_sphere_tree() orders the faces so that such halves are compact.
class LeafBoxes {
 public:
    static constexpr int leaf_faces = FaceBoxes::lanes;

    struct Node {
        int first_child = -1;              // children are first_child and first_child + 1; -1: a leaf
        int face_begin = 0, face_end = 0;  // range of the sphere tree's `faces`
        int leaf = -1;                     // number among the leaves; -1: none
        bool is_leaf() const noexcept { return first_child < 0; }
    };

    /// tree: referred to.
    explicit LeafBoxes(const CollisionTree& tree);

    /// x: referred to until the next pose.
    void begin_pose(const Positions& x) noexcept;

    /// Makes the boxes under a leaf of the sphere tree fit the pose. Returns how many it computed: 0 when
    /// they did already. Until the first pose all boxes are empty.
    int refit(int leaf) noexcept;

    /// The box node that spans all faces of a leaf of the sphere tree.
    int root(int leaf) const noexcept { return ranges_[static_cast<std::size_t>(leaf)].begin; }
    const Node& node(int i) const noexcept { return nodes_[static_cast<std::size_t>(i)]; }
    const Box& box(int i) const noexcept { return boxes_[static_cast<std::size_t>(i)]; }
    /// Of the faces of a leaf, in their order.
    const FaceBoxes& face_boxes(const Node& leaf) const noexcept {
        return face_boxes_[static_cast<std::size_t>(leaf.leaf)];
    }

    /// Row of the face array at position `slot` of the sphere tree's `faces`, and that face in this pose.
    int face(int slot) const noexcept { return tree_->spheres.faces[static_cast<std::size_t>(slot)]; }
    Triangle triangle(int slot) const noexcept {
        return {x_.point(corners_(slot, 0)), x_.point(corners_(slot, 1)), x_.point(corners_(slot, 2))};
    }

 private:
    struct Range {  // of box nodes
        int begin = 0, end = 0;
    };

    Box refit_faces(const Node& leaf) noexcept;

    const CollisionTree* tree_;
    Positions x_;
    std::vector<Range> ranges_;  // [sphere tree nodes], empty but for leaves
    std::vector<Node> nodes_;    // per leaf, breadth first
    std::vector<Box> boxes_;
    std::vector<FaceBoxes> face_boxes_;  // [leaves]
    Faces corners_;                      // of the face in each slot
    std::vector<std::uint64_t> poses_;   // [sphere tree nodes] the pose each leaf's boxes belong to
    std::uint64_t pose_ = 0;
};

}  // namespace nbd
