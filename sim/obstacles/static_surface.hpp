#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "sim/patches/surface_normals.hpp"

namespace nbd {

/// Signed distance of a point to an obstacle.
struct SurfaceDistance {
    double distance = 0;     // metres, negative inside
    Eigen::Vector3d normal;  // unit; direction in which the distance grows
};

/// A closed triangle mesh that never deforms, with a box tree for distance queries.
class StaticSurface {
 public:
    /// Throws std::invalid_argument for an empty or open surface, an index out of range or a non-finite
    /// vertex.
    explicit StaticSurface(TriMesh mesh);

    /// Exact signed distance; nullopt if the point is more than `reach` metres outside the mesh's box.
    std::optional<SurfaceDistance> distance(const Eigen::Vector3d& p, double reach) const noexcept;

    const TriMesh& mesh() const noexcept { return mesh_; }

 private:
    struct BoxNode {
        Eigen::AlignedBox3d box;
        int begin = 0, end = 0;  // range of order_
        int right = -1;          // the left child follows its parent; -1 marks a leaf
    };
    int build(int begin, int end);

    TriMesh mesh_;
    SurfaceTopology topology_;
    std::vector<int> order_;
    std::vector<BoxNode> nodes_;
};

}  // namespace nbd
