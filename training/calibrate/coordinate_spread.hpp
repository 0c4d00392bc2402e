#pragma once

#include <span>

#include "collision/nbd_tree/nbd_bound.hpp"
#include "training/files/frame_source.hpp"
#include "training/networks/mlp.hpp"

namespace nbd {

/// NbdModel::z_mean and z_whitening.
struct CoordinateSpread {
    Eigen::VectorXf mean;       // [m]
    Eigen::MatrixXf whitening;  // [m, m]
};

/// Computes the scaled modal coordinates of poses, [poses, m]. Visits the frames once; same bits on any
/// number of threads.
PoseRows scaled_coordinates(FrameSource& source, std::span<const FrameId> frames, const NbdModel& model);

/// Measures where scaled modal coordinates of poses lie, from their covariance with a little ridge for
/// directions that the poses hardly show. z: at least one row, else throws std::invalid_argument.
CoordinateSpread coordinate_spread(const PoseRows& z);

/// Sets z_mean and z_whitening of the model to coordinate_spread(z).
void fit_coordinate_spread(const PoseRows& z, NbdModel& model);

}  // namespace nbd
