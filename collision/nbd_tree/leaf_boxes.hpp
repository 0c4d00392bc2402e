#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/base/prefetch.hpp"
#include "collision/bounds/walk.hpp"
#include "collision/geometry/posed_faces.hpp"
#include "collision/kernels/box_pack.hpp"
#include "collision/nbd_tree/sphere_tree.hpp"

namespace nbd {

/// Smallest box around the listed vertices, at least one; NaN on an axis on which a position is not finite.
Box bounding_box(const VertexView& x, std::span<const int> vertices) noexcept;

/// A small tree of boxes under every leaf of a sphere tree, with up to 32 boxes per node. In each pose, boxes
/// are fitted only where a query looks. In a step every box holds its faces at both ends, and so at all times
/// between if their corners move straight. Each node divides its range of faces by up to five halvings;
/// build_sphere_tree() orders the faces so that these parts are compact.
class LeafBoxes {
 public:
    static constexpr int max_boxes = 2 * BoxPack::lanes;  // per node

    struct Node {
        int first_child = -1;  // children are first_child to first_child + count - 1; -1: it holds faces
        int parent = -1;       // -1: a root
        int first_slot = 0;    // position of its first face in the sphere tree's `faces`
        int count = 0;         // number of children or faces, 1 to max_boxes
        int vertex_begin = 0, vertex_end = 0;  // vertices of its faces, without repeats
        bool has_faces() const noexcept { return first_child < 0; }
    };

    /// The boxes of a node's children or faces in this pose or step.
    struct Opened {
        std::array<BoxPack, 2> packs;  // the second is used only if the first is full
        Box whole;                     // box around all of them
        int node = 0, count = 0;       // count: number of boxes; 0 before the first pose
        Box box(int k) const noexcept {
            return packs[static_cast<std::size_t>(k / BoxPack::lanes)].box(k % BoxPack::lanes);
        }
    };

    /// tree, F: of the surface; must outlive this object.
    LeafBoxes(const SphereTree& tree, const Faces& F, int vertex_count);
    LeafBoxes(LeafBoxes&&) = default;  // no copies: they would lose the reserved capacity
    LeafBoxes& operator=(LeafBoxes&&) = default;

    /// x: must stay valid until the next pose or step.
    void begin_pose(const VertexView& x) noexcept { begin_step({}, x); }
    /// start, end: likewise.
    void begin_step(const VertexView& start, const VertexView& end) noexcept;

    /// The node that spans all faces of a leaf of the sphere tree.
    int root(int leaf) const noexcept { return roots_[leaf]; }
    const Node& node(int i) const noexcept { return nodes_[i]; }

    /// Box around all faces of a node. The node or its parent must be open.
    Box whole(int i) const noexcept;

    /// Fits the boxes of a node's children or faces to the pose and returns them in order. Open the parent of
    /// a node first.
    const Opened& open(int i) noexcept { return opened_[is_open(i) ? at(i) : fit(i)]; }
    /// Number of nodes opened in this pose.
    long opened() const noexcept { return opened_.size(); }
    /// Whether a position under the nodes opened in this pose is not finite.
    bool met_non_finite() const noexcept { return met_non_finite_; }

    /// Prefetch what opening a root will read, unless it is open: first its vertex list, then their
    /// positions.
    void prefetch_vertices(int root) const noexcept {
        if (!is_open(root)) prefetch_lines(vertices_of(node(root)));
    }
    void prefetch_positions(int root) const noexcept {
        if (is_open(root) || x_.count() == 0) return;
        x_.prefetch(vertices_of(node(root)));
        if (in_step()) start_.prefetch(vertices_of(node(root)));
    }
    /// Prefetches what opening a node below an open one will read.
    void prefetch_node(int i) const noexcept {
        prefetch_line(&at_[i]);
        const Node& n = node(i);
        if (n.has_faces())
            prefetch_lines(std::span(corners(n.first_slot), 3 * static_cast<std::size_t>(n.count)));
    }

    /// Index of the face at position `slot` of the sphere tree's `faces`.
    int face(int slot) const noexcept { return tree_->faces[slot]; }
    /// The faces in this pose, or at the end of the step, numbered by slot.
    PosedFaces faces() const noexcept { return {&corners_, x_}; }

 private:
    const int* corners(int slot) const noexcept { return corners_.data() + 3 * std::ptrdiff_t{slot}; }
    void add_nodes(int face_begin, int face_end);
    void add_parts(int parent, int face_begin, int face_end, int parts);
    void list_vertices(int vertex_count);
    int at(int i) const noexcept { return at_[i]; }
    bool is_open(int i) const noexcept {
        const std::size_t place = at(i);
        return place < opened_.size() && opened_[place].node == i;
    }
    bool in_step() const noexcept { return start_.count() > 0; }
    int fit(int i) noexcept;
    /// Fits the boxes of a node's children or faces to positions. Returns the box around all of them.
    Box fit_to(const VertexView& x, const Node& n, std::array<BoxPack, 2>& packs) noexcept;
    std::span<const int> vertices_of(const Node& n) const noexcept {
        return std::span(vertices_).subspan(n.vertex_begin, n.vertex_end - n.vertex_begin);
    }

    const SphereTree* tree_;
    VertexView x_;             // in the pose, or at the end of the step
    VertexView start_;         // at the start of the step; empty in a pose
    std::vector<int> roots_;   // [sphere tree nodes] root of each leaf; -1 for other nodes
    std::vector<Node> nodes_;  // per leaf, breadth first
    std::vector<int> vertices_;
    Faces corners_;  // corners of the face in each slot
    // Open nodes lie together, to touch little memory. A node is open if the entry of `opened_` that `at_`
    // gives for it names that node.
    std::vector<Opened> opened_;  // at most one per node; the capacity is reserved
    std::vector<int> at_;         // [nodes] index into `opened_`
    bool met_non_finite_ = false;
};

/// A bit for each box of a node. The tests below mask out unused lanes: these are far from every box, but not
/// from a NaN position, nor for a distance whose square overflows.
inline unsigned all_boxes(const LeafBoxes::Opened& node) noexcept {
    return node.count == 0 ? 0 : ~0u >> (LeafBoxes::max_boxes - node.count);
}
inline int pack_count(const LeafBoxes::Opened& node) noexcept { return node.count > BoxPack::lanes ? 2 : 1; }

/// Sets bit k if box k of a node is near t.
inline unsigned near_boxes(const LeafBoxes::Opened& s, const Box& t, const Within& near) noexcept {
    std::uint16_t masks[2] = {0, 0};
    near.all(s.packs.data(), pack_count(s), t, masks);
    return (masks[0] | static_cast<unsigned>(masks[1]) << BoxPack::lanes) & all_boxes(s);
}

/// For each bit i set in `which`, sets bit k of masks[i] if box k of s is near box i of t.
inline void near_boxes(const LeafBoxes::Opened& s, const LeafBoxes::Opened& t, unsigned which,
                       const Within& near, unsigned (&masks)[LeafBoxes::max_boxes]) noexcept {
    near.each(s.packs.data(), pack_count(s), t.packs.data(), which, masks);
    for_each_bit(which, [&](int i) { masks[i] &= all_boxes(s); });
}

}  // namespace nbd
