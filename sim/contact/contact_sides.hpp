#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace nbd {

/// Sides by which surface vertices came into contact with other bodies, and their depths. Flat arrays of
/// equal length, so that a file can store them.
struct ContactSides {
    std::vector<std::array<int, 3>> vertices;  // (body, other body, surface vertex), each once
    std::vector<Eigen::Vector3d> normals;      // unit, outward from the other body
    std::vector<double> depths;                // metres behind the other body's surface, >= 0
};

}  // namespace nbd
