#pragma once

#include "collision/kernels/kernels.hpp"

namespace nbd {

// Not every build of the library has all of these. kernels_for() returns those that the CPU supports.
extern const Kernels kernels_plain, kernels_avx2, kernels_avx512;

}  // namespace nbd
