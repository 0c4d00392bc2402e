#pragma once

#include <span>

#include "collision/modal_model.hpp"
#include "training/frame_stream.hpp"
#include "training/mlp.hpp"

namespace nbd {

/// The scaled codes of poses, [poses, m]. Streams; same bits on any number of threads.
PoseRows scaled_codes(const SurfaceBody& body, const RecordingReader& recording,
                      std::span<const FrameId> frames, const ModalModel& model);

/// Measures where scaled codes of poses lie: ModalModel::code_mean and code_whitening, from their covariance
/// with a little ridge for directions that the poses hardly show. codes: at least one row, else throws
/// std::invalid_argument.
void fit_code_spread(const PoseRows& codes, ModalModel& model);

}  // namespace nbd
