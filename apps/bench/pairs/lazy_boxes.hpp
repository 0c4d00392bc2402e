#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "apps/bench/pairs/point_boxes.hpp"
#include "collision/geometry/posed_faces.hpp"
#include "collision/kernels/box_pack.hpp"
#include "training/files/surface_body.hpp"

namespace nbd {

struct LazyBoxesConfig {
    /// Maximum faces per cluster. A cluster has up to 16 blocks, whose faces are in groups of up to 16.
    int cluster_faces = 1024;
};

/// The strongest known competitor of learned bounds: exact, untrained, and nearly as cheap as reading every
/// vertex once. A pose costs one box per cluster of faces, from a single pass over the vertices. Lower levels
/// are computed only when touched: the boxes of a cluster's blocks when another body's box overlaps the
/// cluster's, and the boxes of a block's faces when one overlaps the block's. All levels are sixteen wide.
///
/// With an embedding, it reads the nodes that carry the surface instead of the surface: if no weight is
/// negative, a vertex lies within the box of its nodes. Positions are then computed for touched blocks only.
class LazyBoxes {
 public:
    /// X: rest positions, for clustering the faces. Throws std::invalid_argument on cluster_faces outside 1
    /// to 4096.
    LazyBoxes(VerticesRef X, FacesRef F, const LazyBoxesConfig& config = {});

    /// Reads nodes. W: kept by reference. Throws as above, and if a weight is negative.
    LazyBoxes(VerticesRef X, FacesRef F, const SurfaceEmbedding& W, const LazyBoxesConfig& config = {});

    /// points: surface [n, 3], or nodes [N, 3] with an embedding; must last until the next pose.
    void begin_pose(VertexView points) noexcept;

    /// Box around the whole body in this pose.
    const Box& box() const noexcept { return all_; }

    /// Writes the intersecting face pairs, sorted, to `pairs`.
    friend void intersecting_faces(LazyBoxes& a, LazyBoxes& b, std::vector<FacePair>& pairs);

 private:
    struct Range {
        int begin = 0, end = 0;
    };

    LazyBoxes(VerticesRef X, FacesRef F, const SurfaceEmbedding* W, const LazyBoxesConfig& config);
    PosedFaces faces() const noexcept { return {&corners_, x_}; }
    void add_vertices(const Range& slots);
    std::vector<int> vertices_of(const Range& slots) const;
    std::vector<int> points_of(const Range& slots) const;
    void refit_blocks(int cluster) noexcept;
    void refit_faces(int block) noexcept;
    void make_positions(int block) noexcept;
    Box grown(const Box& box) const noexcept;
    static void test_blocks(LazyBoxes& a, int block_a, LazyBoxes& b, int block_b, const Box& box_b,
                            std::vector<FacePair>& pairs);
    static void test_clusters(LazyBoxes& a, int cluster_a, const Box& box_a, LazyBoxes& b, int cluster_b,
                              const Box& box_b, std::vector<FacePair>& pairs);

    const SurfaceEmbedding* W_;
    std::vector<int> faces_;       // face numbers, cluster after cluster
    Faces corners_;                // of the face in each slot
    VertexView x_;                 // of the pose
    std::vector<Range> clusters_;  // of blocks
    std::vector<Range> blocks_;    // of groups
    std::vector<Range> groups_;    // of slots
    PointBoxes cluster_points_, block_points_;
    std::vector<Range> block_vertices_;  // with an embedding: of vertices_
    std::vector<int> vertices_;

    std::vector<BoxPack> cluster_boxes_;  // sixteen clusters each
    std::vector<std::uint16_t> near_;     // scratch: one bit per cluster of cluster_boxes_
    std::vector<BoxPack> block_boxes_;    // a cluster's blocks
    std::vector<BoxPack> face_boxes_;     // a group's faces
    std::vector<std::uint64_t> cluster_poses_, block_poses_;  // pose in which the level below was computed
    Vertices made_;                                           // with an embedding: positions
    const float* points_ = nullptr;
    float slack_ = 0;  // with an embedding: bound on rounding errors of positions
    Box all_ = empty_box();
    std::uint64_t pose_ = 0;
};

void intersecting_faces(LazyBoxes& a, LazyBoxes& b, std::vector<FacePair>& pairs);

}  // namespace nbd
