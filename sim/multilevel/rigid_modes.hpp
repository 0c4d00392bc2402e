#pragma once

#include <Eigen/Core>
#include <vector>

#include "meshing/surface/mesh.hpp"
#include "sim/multilevel/aggregates.hpp"

namespace nbd {

/// For each row of a matrix, how its B unknowns move in each of the six rigid motions of the whole body.
template <int B>
using RigidModes = std::vector<Eigen::Matrix<double, B, 6>>;

/// Three translations, and three rotations about the mean of the nodes, scaled to be of similar size.
RigidModes<3> rigid_modes(const Nodes& X);

/// Piecewise rigid motions of aggregates.
template <int B>
struct Tentative {
    BlockSparse<B, 6> P;  // orthonormal columns, or zeros; row i has one block, none if i has no aggregate
    RigidModes<6> modes;  // of the aggregates: P times these are the modes of the rows
};

/// Orthonormalises the rigid motions of each aggregate. A motion that leaves an aggregate at rest, such as
/// the rotation of two nodes about their line, gives a zero column.
template <int B>
Tentative<B> tentative(const Aggregates& aggregates, const RigidModes<B>& modes);

}  // namespace nbd
