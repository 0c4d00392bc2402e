#pragma once

#include "collision/kernels/kernels.hpp"

namespace nbd {

// Not all of them are in every build of the library; kernels_for() knows which ones the machine can run.
extern const Kernels kernels_plain, kernels_avx2, kernels_avx512;

}  // namespace nbd
