#pragma once

#include <span>

#include "collision/bounds/learned/nbd_model.hpp"
#include "training/files/frame_stream.hpp"
#include "training/networks/mlp.hpp"

namespace nbd {

/// The scaled modal coordinates of the frames, [poses, m]. Streams; same bits on any number of threads.
PoseRows scaled_coordinates(const SurfaceBody& body, const RecordingReader& recording,
                            std::span<const FrameId> frames, const NbdModel& model);

/// Measures the spread of scaled modal coordinates: sets NbdModel::z_mean and z_whitening from their mean and
/// covariance, with a small ridge for directions that the poses hardly show. z: [poses, m]; throws
/// std::invalid_argument if it has no row.
void fit_coordinate_spread(const PoseRows& z, NbdModel& model);

}  // namespace nbd
