#pragma once

#include <cstdint>
#include <vector>

#include "collision/box_pack.hpp"
#include "collision/collision_tree.hpp"
#include "collision/positions.hpp"

namespace nbd {

/// A small tree of boxes under every leaf of a sphere tree, eight to a node, refitted as a whole when its
/// leaf is first visited in a pose. Its nodes cut the leaf's range of faces into eighths again and again, by
/// three halvings each, the topmost one by fewer where that fills the lowest ones: build_sphere_tree() orders
/// the faces so that such parts are compact.
class LeafBoxes {
 public:
    static constexpr int lanes = BoxPack::lanes;

    struct Node {
        int first_child = -1;  // the children are first_child up to first_child + count - 1; -1: faces
        int first_slot = 0;    // of the faces: their slots in the sphere tree's `faces`
        int count = 0;         // children or faces, 1 to 8
        bool has_faces() const noexcept { return first_child < 0; }
    };

    /// tree: referred to.
    explicit LeafBoxes(const CollisionTree& tree);

    /// x: referred to until the next pose.
    void begin_pose(const Positions& x) noexcept;

    /// Makes the boxes under a leaf of the sphere tree fit the pose. Returns how many it computed: 0 when
    /// they did already. Until the first pose all boxes are empty.
    int refit(int leaf) noexcept;

    /// The node that spans all faces of a leaf of the sphere tree.
    int root(int leaf) const noexcept { return ranges_[static_cast<std::size_t>(leaf)].begin; }
    const Node& node(int i) const noexcept { return nodes_[static_cast<std::size_t>(i)]; }
    /// Of its children or faces, in their order.
    const BoxPack& boxes(int i) const noexcept { return boxes_[static_cast<std::size_t>(i)]; }
    /// Around all of them.
    const Box& whole(int i) const noexcept { return wholes_[static_cast<std::size_t>(i)]; }

    /// Has the cache bring what refit(leaf) will read, where that reads anything.
    void fetch(int leaf) const noexcept {
        if (poses_[static_cast<std::size_t>(leaf)] != pose_) x_.fetch(tree_->spheres.node_vertices(leaf));
    }

    /// Row of the face array at position `slot` of the sphere tree's `faces`.
    int face(int slot) const noexcept { return tree_->spheres.faces[static_cast<std::size_t>(slot)]; }
    /// The vertices of that face, and where they are in this pose.
    const int* corners(int slot) const noexcept { return corners_.data() + 3 * std::ptrdiff_t{slot}; }
    Triangle triangle(int slot) const noexcept {
        const int* v = corners(slot);
        return {x_.point(v[0]), x_.point(v[1]), x_.point(v[2])};
    }
    const Positions& positions() const noexcept { return x_; }

 private:
    struct Range {  // of nodes
        int begin = 0, end = 0;
    };

    void add_nodes(int face_begin, int face_end);
    void add_parts(int face_begin, int face_end, int parts);
    void refit_node(int i) noexcept;

    const CollisionTree* tree_;
    Positions x_;
    std::vector<Range> ranges_;  // [sphere tree nodes], empty but for leaves
    std::vector<Node> nodes_;    // per leaf, breadth first
    std::vector<BoxPack> boxes_;
    std::vector<Box> wholes_;
    Faces corners_;                     // of the face in each slot
    std::vector<std::uint64_t> poses_;  // [sphere tree nodes] the pose each leaf's boxes belong to
    std::uint64_t pose_ = 0;
};

}  // namespace nbd
