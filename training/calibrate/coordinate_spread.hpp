#pragma once

#include <span>

#include "collision/bounds/learned/nbd_model.hpp"
#include "training/files/frame_stream.hpp"
#include "training/networks/mlp.hpp"

namespace nbd {

/// The scaled codes of poses, [poses, m]. Streams; same bits on any number of threads.
PoseRows scaled_coordinates(const SurfaceBody& body, const RecordingReader& recording,
                            std::span<const FrameId> frames, const NbdModel& model);

/// Measures where scaled codes of poses lie: NbdModel::z_mean and z_whitening, from their covariance
/// with a little ridge for directions that the poses hardly show. codes: at least one row, else throws
/// std::invalid_argument.
void fit_coordinate_spread(const PoseRows& z, NbdModel& model);

}  // namespace nbd
