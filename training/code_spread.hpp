#pragma once

#include <span>

#include "collision/modal_model.hpp"
#include "training/frame_stream.hpp"

namespace nbd {

/// Measures where the scaled codes of these poses lie: ModalModel::code_mean and code_whitening, from their
/// covariance with a little ridge for directions that the poses hardly show. Streams; same bits on any number
/// of threads. Throws std::invalid_argument on no frames.
void measure_code_spread(const SurfaceBody& body, const RecordingReader& recording,
                         std::span<const FrameId> frames, ModalModel& model);

}  // namespace nbd
