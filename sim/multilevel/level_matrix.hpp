#pragma once

#include <type_traits>

#include "sim/factor/float_blocks.hpp"
#include "sim/factor/scaled_blocks.hpp"
#include "sim/factor/sweep_matrix.hpp"

namespace nbd {

/// The matrix of one body at a level, off the diagonal: of nodes (B = 3) as the step has it, of aggregates in
/// less memory.
template <int B>
using LevelMatrix = SweepMatrix<std::conditional_t<B == 3, FloatBlocks<B, B>, ScaledBlocks<B, B>>>;

}  // namespace nbd
