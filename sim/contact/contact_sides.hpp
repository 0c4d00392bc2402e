#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace nbd {

/// Through which side of other bodies the surface vertices of a world's bodies came into contact, and how
/// deep they are. Flat arrays of equal length, so that a file can keep them.
struct ContactSides {
    std::vector<std::array<int, 3>> vertices;  // (body, other body, surface vertex), each once
    std::vector<Eigen::Vector3d> normals;      // unit, out of the other body
    std::vector<double> depths;                // metres behind its surface, >= 0
};

}  // namespace nbd
