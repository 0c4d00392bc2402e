#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "meshing/surface/box_tree.hpp"
#include "sim/patches/surface_normals.hpp"

namespace nbd {

/// Signed distance of a point to an obstacle.
struct SurfaceDistance {
    double distance = 0;     // metres, negative inside; an open surface has no inside
    Eigen::Vector3d normal;  // unit; direction in which the distance grows
};

/// A triangle mesh that never deforms, with a tree of boxes for distance queries. One that is closed is
/// solid; one with open edges is a sheet with two sides.
class StaticSurface {
 public:
    /// Throws std::invalid_argument for an empty surface, an index out of range or a non-finite vertex.
    explicit StaticSurface(TriMesh mesh);

    /// Exact signed distance; nullopt if the point is more than `reach` metres outside the mesh's box.
    std::optional<SurfaceDistance> distance(const Eigen::Vector3d& p, double reach) const noexcept;

    const TriMesh& mesh() const noexcept { return mesh_; }
    bool is_open() const noexcept { return is_open_; }

 private:
    TriMesh mesh_;
    SurfaceTopology topology_;
    Eigen::AlignedBox3d box_;
    BoxTree faces_;
    bool is_open_;
};

}  // namespace nbd
