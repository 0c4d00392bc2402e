#pragma once

#include <Eigen/Core>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Vertices that make contact with other bodies for all, where a surface is much finer than the nodes that
/// carry it. Surfaces of fewer than 12 vertices for each of these nodes keep all. Of others, the vertices in
/// a cell of a grid over the rest pose that face one way keep three: the one that stands out most, then those
/// that are farthest from the ones kept. A cell is as wide as a square of the area of sixteen vertices, or of
/// a quarter of those for each node if that is more.
struct ContactSamples {
    std::vector<bool> kept;  // [n]
    Eigen::VectorXd areas;   // [n] m2: of the vertices that each one stands for; 0 unless kept
};

/// rest: positions at rest, [n, 3]. rest_areas: [n] m2. carriers: number of nodes that carry the surface.
ContactSamples contact_samples(const Faces& F, const Nodes& rest, const Eigen::VectorXd& rest_areas,
                               int carriers);

}  // namespace nbd
