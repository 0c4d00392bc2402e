#pragma once

#include <vector>

#include "meshing/cage/soup_wrap.hpp"
#include "meshing/surface/mesh.hpp"

namespace nbd {

/// A regular grid of points over a box, to compare the insides of two closed surfaces.
class ChamberGrid {
 public:
    explicit ChamberGrid(const Eigen::AlignedBox3d& box);

    /// The chambers of `coarse` are its inside farther than `depth` from the soup. Returns the share of them
    /// that `fine` leaves out; 0 if they are less than a twentieth of the inside.
    double share_lost(const TriMesh& coarse, const TriMesh& fine, const SoupWrap& soup, double depth) const;

 private:
    static constexpr int side = 40;  // points along each axis
    std::vector<char> inside(const TriMesh& surface) const;
    Eigen::Vector3d point(int i, int j, int k) const;
    Eigen::Vector3d corner_, step_;
};

}  // namespace nbd
