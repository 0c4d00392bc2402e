#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "collision/base/aligned_vector.hpp"
#include "collision/geometry/posed_faces.hpp"
#include "collision/kernels/box_pack.hpp"

namespace nbd {

/// A linear bounding volume hierarchy: a competitor that is built anew
/// in every pose, by sorting faces along a space-filling curve (Morton codes of 30 bits). Its nodes are
/// sixteen wide: the faces, in sorted order, are cut into runs of sixteen, these into runs of sixteen, and so
/// on.
class LinearBvh {
 public:
    explicit LinearBvh(FacesRef F) : corners_(F) {}

    /// Reads the vertices of a pose; they must last until the next one. x: [n, 3].
    void begin_pose(VertexView x) noexcept;
    /// Builds the hierarchy of the faces whose boxes have a point in common with `region`.
    void build(const Box& region);

    /// Box around the whole body in this pose.
    const Box& whole() const noexcept { return whole_; }

    /// Writes the intersecting face pairs of two built hierarchies, sorted, to `pairs`.
    friend void intersecting_faces(const LinearBvh& a, const LinearBvh& b, std::vector<FacePair>& pairs);

 private:
    static constexpr int lanes = BoxPack::lanes;
    static constexpr int most_levels = 8;  // 16^8 faces exceed int
    using Key = std::uint64_t;             // Morton code, then the index in boxes_

    void list_faces(const Box& region);
    void sort_faces();
    void add_level(int below);
    PosedFaces faces() const noexcept { return {&corners_, x_}; }
    unsigned present(int level, int node) const noexcept;
    static void walk(const LinearBvh& a, int level_a, int node_a, const Box& box_a, const LinearBvh& b,
                     int level_b, int node_b, const Box& box_b, std::vector<FacePair>& pairs);

    Faces corners_;
    Positions x_;  // of the pose
    Box whole_ = empty_box();
    std::vector<Box> boxes_;   // of the faces in the region
    std::vector<int> listed_;  // and which faces they are
    std::vector<Key> keys_, sorted_;
    std::vector<int> faces_;                                  // in the order of the curve
    std::array<AlignedVector<BoxPack>, most_levels> levels_;  // of faces, of runs of faces, and so on
    std::array<int, most_levels> boxes_in_{};                 // boxes in each level
    int height_ = 0;                                          // levels in use
};

void intersecting_faces(const LinearBvh& a, const LinearBvh& b, std::vector<FacePair>& pairs);

}  // namespace nbd
