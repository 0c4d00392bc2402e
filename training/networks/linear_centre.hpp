#pragma once

#include "training/networks/mlp.hpp"

namespace nbd {

/// The linear part of the nodes' centres: for each, the map from the scaled code that fits its centre best in
/// the least-squares sense, with a constant that is left to who calls, and a little ridge for directions that
/// the poses hardly show. Takes it out of the labels.
/// codes: [poses, m], scaled. spheres: [poses, 4 nodes], dc x y z and dr of every node, metres; in and out.
/// Returns the map, [m, 3 nodes]. Same bits on any number of threads.
Eigen::MatrixXf take_linear_centre(const PoseRows& z, PoseRows& spheres);

}  // namespace nbd
