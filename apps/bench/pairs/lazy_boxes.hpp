#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "collision/geometry/posed_faces.hpp"
#include "collision/kernels/box_pack.hpp"

namespace nbd {

/// Boxes of fixed lists of points, computed from a pose on demand.
class PointBoxes {
 public:
    /// point_count: points in every pose.
    explicit PointBoxes(int point_count) : last_(3 * (point_count - 1)) {}

    /// Appends a list. points: without repeats, best ascending.
    void add(std::span<const int> points);

    /// Box of a list. x: [point_count, 3], contiguous.
    Box box(int list, const float* x) const noexcept;

    int size() const noexcept { return ends_.size(); }

 private:
    int last_;  // first float of the last point, stored apart because four floats cannot be read from it
    std::vector<int> floats_;     // first float of each point, list after list
    std::vector<int> ends_;       // end of each list in floats_
    std::vector<int> with_last_;  // lists that have the last point, ascending
};

/// The strongest known competitor of learned bounds: exact, untrained, and nearly as cheap as reading every
/// vertex once. A pose costs one box per cluster of faces, from a single pass over the vertices. Lower levels
/// are computed only when touched: the boxes of a cluster's blocks when another body's box overlaps the
/// cluster's, and the boxes of a block's faces when one overlaps the block's. All levels are sixteen wide.
class LazyBoxes {
 public:
    /// X: rest positions, for clustering the faces. cluster_faces: maximum of a cluster, which has up to 16
    /// blocks, whose faces are in groups of up to 16. Throws std::invalid_argument on cluster_faces outside 1
    /// to 4096.
    LazyBoxes(VerticesRef X, FacesRef F, int cluster_faces = 1024);

    /// x: [n, 3]; must last until the next pose.
    void begin_pose(VertexView x) noexcept;

    /// Writes the intersecting face pairs, sorted, to `pairs`.
    friend void intersecting_faces(LazyBoxes& a, LazyBoxes& b, std::vector<FacePair>& pairs);

 private:
    struct Range {
        int begin = 0, end = 0;
    };

    PosedFaces faces() const noexcept { return {&corners_, x_}; }
    std::vector<int> vertices_of(const Range& slots) const;
    void refit_blocks(int cluster) noexcept;
    void refit_faces(int block) noexcept;
    static void test_blocks(LazyBoxes& a, int block_a, LazyBoxes& b, int block_b, const Box& box_b,
                            std::vector<FacePair>& pairs);
    static void test_clusters(LazyBoxes& a, int cluster_a, const Box& box_a, LazyBoxes& b, int cluster_b,
                              const Box& box_b, std::vector<FacePair>& pairs);

    std::vector<int> faces_;       // face numbers, cluster after cluster
    Faces corners_;                // of the face in each slot
    VertexView x_;                 // of the pose
    std::vector<Range> clusters_;  // of blocks
    std::vector<Range> blocks_;    // of groups
    std::vector<Range> groups_;    // of slots
    PointBoxes cluster_points_, block_points_;

    std::vector<BoxPack> cluster_boxes_;  // sixteen clusters each
    std::vector<std::uint16_t> near_;     // scratch: one bit per cluster of cluster_boxes_
    std::vector<BoxPack> block_boxes_;    // a cluster's blocks
    std::vector<BoxPack> face_boxes_;     // a group's faces
    std::vector<std::uint64_t> cluster_poses_, block_poses_;  // pose in which the level below was computed
    const float* points_ = nullptr;                           // of the pose
    Box all_ = empty_box();
    std::uint64_t pose_ = 0;
};

void intersecting_faces(LazyBoxes& a, LazyBoxes& b, std::vector<FacePair>& pairs);

}  // namespace nbd
