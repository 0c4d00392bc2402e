#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "collision/base/aligned_vector.hpp"
#include "collision/geometry/box.hpp"
#include "collision/geometry/posed_faces.hpp"
#include "collision/geometry/vertex_view.hpp"
#include "collision/kernels/box_pack.hpp"
#include "collision/wide_tree/affine_model.hpp"
#include "collision/wide_tree/learned_affine.hpp"
#include "collision/wide_tree/wide_tree.hpp"

namespace nbd {

/// What was computed of some parts of a body in the present pose, one T a part. They lie in the order in
/// which they were added, so that a query that looks at few parts touches little memory. Allocates only if a
/// pose adds more than any before it.
template <class T>
class PoseCache {
 public:
    explicit PoseCache(int parts) : places_(parts) {}

    void begin_pose() noexcept {
        in_use_ = 0;
        if (++pose_ != 0) return;
        std::ranges::fill(places_, Place{});  // the counter wrapped around: mark all as old
        pose_ = 1;
    }

    bool has(int part) const noexcept { return places_[part].pose == pose_; }
    /// Only of a part that was added in this pose. Valid until the next one is.
    const T& operator[](int part) const noexcept { return values_[places_[part].at]; }
    /// Adds a part, to be filled in: its contents are unspecified. Throws std::bad_alloc, and has not added
    /// it then.
    T& add(int part) {
        if (values_.size() == static_cast<std::size_t>(in_use_)) values_.emplace_back();
        places_[part] = {pose_, in_use_};
        return values_[in_use_++];
    }

    /// Makes room for poses that add all parts.
    void reserve() { values_.reserve(places_.size()); }

 private:
    struct Place {
        std::uint32_t pose = 0;  // in which the part was added last
        int at = 0;              // index into values_
    };

    std::vector<Place> places_;
    AlignedVector<T> values_;
    int in_use_ = 0;
    std::uint32_t pose_ = 1;
};

/// A wide tree in a pose: the boxes of its nodes by an affine model. A pose begins with the boxes of the
/// clusters; the levels below are fitted where a query looks. All boxes contain what they bound, despite
/// rounding, except learned ones, which contain it as calibrated. Boxes of faces are exact.
class PosedWideTree {
 public:
    /// The children of a cluster or of a block in this pose.
    struct Children {
        BoxPack boxes;  // one per child
        Box whole;
        bool are_oriented = false;  // whether `oriented` is filled in
        OrientedBoxes oriented;
    };

    /// The faces of a leaf in this pose.
    struct Leaf {
        BoxPack boxes;  // one per face
        Box whole;
        Eigen::Array4f x[WideTree::max_leaf_vertices];  // positions; lane 3 is unspecified
    };

    /// learned: replaces the boxes of clusters, blocks and leaves where it is in range. model is then that of
    /// the surface's own vertices.
    explicit PosedWideTree(std::shared_ptr<const AffineModel> model,
                           std::optional<LearnedAffineBoxes> learned = {});
    PosedWideTree(PosedWideTree&&) = default;  // no copies: they would refer to the nodes of another
    PosedWideTree& operator=(PosedWideTree&&) = default;

    /// Starts a pose. nodes: [model's nodes, 3], must stay valid until the next pose.
    void begin_pose(VertexView nodes);

    /// Starts a step of linear motion: every box holds what it bounds at the start, at the end and at all
    /// times between, if vertices move straight from W start to W end. Boxes of faces are the hulls of those
    /// at both ends. Positions are those at the end. start, end: like the nodes of a pose.
    void begin_step(VertexView start, VertexView end);

    /// Ends the pose or step: as before the first one.
    void forget_pose() noexcept;
    /// Makes room for poses in which all leaves are asked for.
    void reserve() {
        clusters_.reserve();
        blocks_.reserve();
        leaves_.reserve();
    }

    const WideTree& tree() const noexcept { return *tree_; }
    bool has_pose() const noexcept { return nodes_ != nullptr; }
    /// Whether a number that was read in this pose so far was not finite. Boxes of it mean nothing.
    bool met_non_finite() const noexcept {
        return met_non_finite_ || (learned_ && learned_->met_non_finite());
    }
    /// Throws std::invalid_argument, naming the first vertex or node, if a number that was read in this pose
    /// so far is not finite. Positions that are finite and overflow in boxes are near everything.
    void require_finite() const;
    bool in_step() const noexcept { return start_ != nullptr; }

    /// Box around the whole body.
    const Box& whole() const noexcept { return whole_; }
    /// Boxes of all clusters, sixteen a pack.
    const BoxPack* cluster_boxes() const noexcept { return cluster_boxes_.data(); }
    int cluster_packs() const noexcept { return cluster_boxes_.size(); }
    /// Boxes of a cluster, and of a block whose cluster's blocks were asked for in this pose. Once its own
    /// children were asked for, it is the box around them, which may be another, mostly a smaller one.
    Box cluster(int i) const noexcept {
        if (clusters_.has(i)) return clusters_[i].whole;
        return cluster_boxes_[static_cast<std::size_t>(i / tree_width)].box(i % tree_width);
    }
    Box block(int i) const noexcept {
        if (blocks_.has(i)) return blocks_[i].whole;
        const int cluster = tree_->cluster_of[i];
        return clusters_[cluster].boxes.box(i - first_block(cluster));
    }
    /// First block of a cluster.
    int first_block(int cluster) const noexcept { return tree_->first_block[cluster]; }
    /// The blocks of a cluster, the leaves of a block and a leaf. Valid until one of the same kind is asked
    /// for that was not asked for before.
    const Children& blocks(int cluster) {
        if (!clusters_.has(cluster)) fit_cluster(cluster);
        return clusters_[cluster];
    }
    const Children& leaves(int block) {
        if (!blocks_.has(block)) fit_block(block);
        return blocks_[block];
    }
    const Leaf& leaf(int i) {
        if (!leaves_.has(i)) fit_leaf(i);
        return leaves_[i];
    }
    /// Bits of the children that are present.
    unsigned present_blocks(int cluster) const noexcept { return bits(tree_->blocks_in(cluster)); }
    unsigned present_leaves(int block) const noexcept { return bits(tree_->leaves_in[block]); }
    unsigned present_faces(int leaf) const noexcept { return bits(tree_->faces_in[leaf]); }

    /// Where the corners of a face stand, four numbers each. slot: of a leaf that was asked for in this pose.
    FaceCorners corners(int slot, Eigen::Array4f& /*spare*/) const noexcept {
        const int leaf = slot / tree_width;
        const Eigen::Array4f* x = leaves_[leaf].x;
        const std::uint8_t* at = tree_->corners[leaf].data() + slot % tree_width;
        return {x[at[0]].data(), x[at[tree_width]].data(), x[at[2 * tree_width]].data()};
    }
    Triangle triangle(int slot) const noexcept {
        Eigen::Array4f spare;
        const FaceCorners c = corners(slot, spare);
        using Point = Eigen::Map<const Eigen::Vector3f>;
        return {Point(c[0]), Point(c[1]), Point(c[2])};
    }
    /// The faces in this pose, numbered by slot.
    const PosedWideTree& faces() const noexcept { return *this; }
    std::array<int, 3> face_vertices(int slot) const noexcept { return tree_->face_vertices(slot); }
    int face(int slot) const noexcept { return tree_->faces[slot]; }

    /// Prefetch what blocks(), leaves() and leaf() will read.
    void prefetch_cluster(int cluster) const noexcept;
    void prefetch_block(int block) const noexcept;
    void prefetch_leaf(int leaf) const noexcept;

    /// Number of nodes and leaves that were fitted in this pose.
    int bounded() const noexcept { return bounded_; }
    /// Number of learned bounds in this pose whose samples were out of range.
    int out_of_range() const noexcept { return learned_ ? learned_->out_of_range() : 0; }

 private:
    static unsigned bits(int count) noexcept { return (1u << count) - 1; }
    void begin() noexcept;
    void fit_cluster(int cluster);
    void fit_block(int block);
    /// learned: the children's boxes are there.
    void fit_children(const AffineParts& parts, int part, int count, bool learned,
                      Children& children) noexcept;
    void fit_leaf(int leaf);
    void leaf_vertices(int leaf, const float* nodes, Eigen::Array4f* x) const noexcept;
    /// Fills in the children of a part with a map.
    void map_children(const AffineParts& parts, int part, Children& children) noexcept;
    /// Boxes of a leaf's faces, and the box around all of them, from positions of its vertices.
    void leaf_boxes(int leaf, const Eigen::Array4f* x, BoxPack& boxes, Box& whole) noexcept;
    /// How far vertices may leave a box of the nodes on which they hang, by rounding errors, metres.
    float slack(const Box& box) const noexcept;
    Box widened(const Box& box) const noexcept;
    /// nodes: ascending places.
    bool has_last_node(std::span<const int> nodes) const noexcept;
    /// Whether this pose uses the learned boxes; a step does not.
    bool is_learned() const noexcept { return learned_ && !start_; }
    void set_cluster_box(int cluster, const Box& box) noexcept;
    void exact_cluster_boxes() noexcept;
    void learned_cluster_boxes() noexcept;
    /// box_at(nodes): of the pose, or joined from both ends of the step.
    template <class BoxAt>
    Box over_step(const BoxAt& box_at) const noexcept;
    Box box_of_nodes(std::span<const int> nodes) noexcept;
    void boxes_of_blocks(int cluster, int count, BoxPack& boxes) noexcept;
    /// Of the children of a part that lists their nodes.
    void boxes_of_child_nodes(const AffineParts& parts, int part, int count, BoxPack& boxes) noexcept;
    Box box_of_node(const float* p) noexcept;

    std::shared_ptr<const AffineModel> model_;
    std::optional<LearnedAffineBoxes> learned_;
    const WideTree* tree_;
    VertexView given_, given_start_;  // what the pose or step was given by
    const float* nodes_ = nullptr;    // of the pose, or at the end of the step, three numbers each
    const float* start_ = nullptr;    // at the start of the step; null: a pose
    Vertices own_, own_start_;        // nodes whose rows were not contiguous
    Box whole_ = empty_box();
    std::vector<Box> boxes_, boxes_at_start_;  // of the clusters' nodes
    AlignedVector<BoxPack> cluster_boxes_;     // sixteen clusters each
    PoseCache<Children> clusters_, blocks_;
    PoseCache<Leaf> leaves_;
    std::vector<float> scratch_;
    int bounded_ = 0;
    bool met_non_finite_ = false;
    bool reads_unchecked_ = false;  // whether positions in leaves may be the first that are not finite
};

}  // namespace nbd
