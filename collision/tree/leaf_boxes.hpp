#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "collision/base/prefetch.hpp"
#include "collision/geometry/posed_faces.hpp"
#include "collision/kernels/box_pack.hpp"
#include "collision/tree/collision_tree.hpp"

namespace nbd {

/// A small tree of boxes under every leaf of a sphere tree, up to 32 to a node, made where a query looks in a
/// pose and nowhere else. Its nodes cut the leaf's range of faces in halves again and again, up to five times
/// each: build_sphere_tree() orders the faces so that such parts are compact.
class LeafBoxes {
 public:
    static constexpr int max_boxes = 2 * BoxPack::lanes;  // of a node

    struct Node {
        int first_child = -1;  // the children are first_child up to first_child + count - 1; -1: faces
        int parent = -1;       // -1: a root
        int first_slot = 0;    // of the faces: their slots in the sphere tree's `faces`
        int count = 0;         // children or faces, 1 to max_boxes
        int vertex_begin = 0, vertex_end = 0;  // of all its faces, without repeats
        bool has_faces() const noexcept { return first_child < 0; }
    };

    /// The boxes of a node's children, or faces, in this pose.
    struct Opened {
        std::array<BoxPack, 2> packs;  // the second one only where the first is full
        Box whole;                     // around all of them
        int node = 0, count = 0;       // how many boxes: none before the first pose
        Box box(int k) const noexcept {
            return packs[static_cast<std::size_t>(k / BoxPack::lanes)].box(k % BoxPack::lanes);
        }
    };

    /// tree: referred to.
    explicit LeafBoxes(const CollisionTree& tree);
    LeafBoxes(LeafBoxes&&) = default;  // what queries refer to must not move: no copies

    /// x: referred to until the next pose.
    void begin_pose(const Positions& x) noexcept;

    /// The node that spans all faces of a leaf of the sphere tree.
    int root(int leaf) const noexcept { return roots_[static_cast<std::size_t>(leaf)]; }
    const Node& node(int i) const noexcept { return nodes_[static_cast<std::size_t>(i)]; }

    /// The box around all faces of a node that was opened, or whose parent was.
    Box whole(int i) const noexcept;

    /// Makes the boxes of a node's children or faces fit the pose, and returns them in their order. A node
    /// other than a root: after its parent.
    const Opened& open(int i) noexcept {
        return opened_[static_cast<std::size_t>(is_open(i) ? at(i) : fit(i))];
    }
    /// Nodes opened in this pose.
    long opened() const noexcept { return static_cast<long>(opened_.size()); }

    /// Have the cache bring what opening a root will read, where that reads anything: first which vertices,
    /// then where they are.
    void prefetch_vertices(int root) const noexcept {
        if (!is_open(root)) prefetch_lines(vertices_of(node(root)));
    }
    void prefetch_positions(int root) const noexcept {
        if (!is_open(root) && x_.rows().rows() > 0) x_.prefetch(vertices_of(node(root)));
    }
    /// Likewise for a node below an open one.
    void prefetch_node(int i) const noexcept {
        prefetch_line(&at_[static_cast<std::size_t>(i)]);
        const Node& n = node(i);
        if (n.has_faces())
            prefetch_lines(std::span(corners(n.first_slot), 3 * static_cast<std::size_t>(n.count)));
    }

    /// Row of the face array at position `slot` of the sphere tree's `faces`.
    int face(int slot) const noexcept { return tree_->spheres.faces[static_cast<std::size_t>(slot)]; }
    /// The faces in this pose, slot by slot.
    PosedFaces faces() const noexcept { return {&corners_, x_}; }
    Triangle triangle(int slot) const noexcept { return faces().triangle(slot); }

 private:
    const int* corners(int slot) const noexcept { return corners_.data() + 3 * std::ptrdiff_t{slot}; }
    void add_nodes(int face_begin, int face_end);
    void add_parts(int parent, int face_begin, int face_end, int parts);
    void list_vertices();
    int at(int i) const noexcept { return at_[static_cast<std::size_t>(i)]; }
    bool is_open(int i) const noexcept {
        const auto place = static_cast<std::size_t>(at(i));
        return place < opened_.size() && opened_[place].node == i;
    }
    int fit(int i) noexcept;
    std::span<const int> vertices_of(const Node& n) const noexcept {
        return std::span(vertices_).subspan(static_cast<std::size_t>(n.vertex_begin),
                                            static_cast<std::size_t>(n.vertex_end - n.vertex_begin));
    }

    const CollisionTree* tree_;
    Positions x_;
    std::vector<int> roots_;   // [sphere tree nodes], -1 but for leaves
    std::vector<Node> nodes_;  // per leaf, breadth first
    std::vector<int> vertices_;
    Faces corners_;  // of the face in each slot
    // What a pose opens lies together, so that little memory is touched. A node is open if its place in
    // `opened_` is taken by itself.
    std::vector<Opened> opened_;  // never more than there are nodes: room for all is reserved
    std::vector<int> at_;         // [nodes] a place in `opened_`
};

}  // namespace nbd
