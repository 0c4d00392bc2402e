#pragma once

#include "training/networks/mlp.hpp"

namespace nbd {

/// Fits the linear part of the nodes' centres and subtracts it from the labels. Each node's centre is fitted
/// by least squares as a linear map of the scaled modal coordinates, plus a constant that stays in the
/// labels. A small ridge covers directions that the poses hardly show.
/// z: [poses, m], scaled. spheres: [poses, 4 nodes], dc x y z and dr of every node, metres; in and out.
/// Returns the map, [m, 3 nodes]. Same bits on any number of threads.
Eigen::MatrixXf take_linear_centre(const PoseRows& z, PoseRows& spheres);

}  // namespace nbd
