#pragma once

#include <vector>

#include "meshing/cage/soup_wrap.hpp"
#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Marks points of a regular grid over a box.
class ChamberGrid {
 public:
    explicit ChamberGrid(const Eigen::AlignedBox3d& box);

    /// Marks the points inside a closed surface that are farther than `depth` from the soup.
    std::vector<char> chambers(const TriMesh& surface, const SoupWrap& soup, double depth) const;

    /// The share of the marked points that lie inside a closed surface; 1 if none is marked.
    double share_inside(const std::vector<char>& marked, const TriMesh& surface) const;

 private:
    static constexpr int side = 40;  // points along each axis
    std::vector<char> inside(const TriMesh& surface) const;
    Eigen::Vector3d point(int i, int j, int k) const;
    Eigen::Vector3d corner_, step_;
};

}  // namespace nbd
