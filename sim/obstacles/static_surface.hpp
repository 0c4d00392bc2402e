#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "meshing/surface/box_tree.hpp"
#include "sim/patches/surface_normals.hpp"

namespace nbd {

/// Signed distance of a point to an obstacle.
struct SurfaceDistance {
    double distance = 0;     // metres, negative inside
    Eigen::Vector3d normal;  // unit; direction in which the distance grows
};

/// A closed triangle mesh that never deforms, with a tree of boxes for distance queries.
class StaticSurface {
 public:
    /// Throws std::invalid_argument for an empty or open surface, an index out of range or a non-finite
    /// vertex.
    explicit StaticSurface(TriMesh mesh);

    /// Exact signed distance; nullopt if the point is more than `reach` metres outside the mesh's box.
    std::optional<SurfaceDistance> distance(const Eigen::Vector3d& p, double reach) const noexcept;

    const TriMesh& mesh() const noexcept { return mesh_; }

 private:
    TriMesh mesh_;
    SurfaceTopology topology_;
    Eigen::AlignedBox3d box_;
    BoxTree faces_;
};

}  // namespace nbd
