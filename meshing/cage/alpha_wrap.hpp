#pragma once

#include <Eigen/Geometry>
#include <memory>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Closed surfaces around a triangle soup by alpha wrapping [Portaneri22]. CGAL searches a triangle longer
/// than 3 alpha in pieces, which takes memory that grows with (length / alpha)^2.
class AlphaWrap {
 public:
    /// soup: finite, indices in range, at least two distinct vertices. May be open, non-manifold and
    /// self-intersecting. Faces without area count as their sides.
    explicit AlphaWrap(const TriMesh& soup);
    ~AlphaWrap();
    AlphaWrap(AlphaWrap&&) noexcept;

    /// A closed manifold surface without self-intersections, oriented outward, that strictly holds the soup.
    /// alpha: a ball of this radius does not fit through the openings that the surface closes, metres, > 0;
    /// its edges have about this length. offset: distance of its vertices from the soup, metres, > 0.
    /// The same input gives the same bits.
    TriMesh wrap(double alpha, double offset) const;

    /// Distance from a point to the soup.
    double distance(const Eigen::Vector3d& point) const;

    /// The soup's bounding box.
    const Eigen::AlignedBox3d& box() const noexcept { return box_; }

 private:
    struct Soup;
    std::unique_ptr<const Soup> soup_;
    Eigen::AlignedBox3d box_;
};

}  // namespace nbd
