// The kernels for AVX2, which this file is compiled for. Functions of other headers must not be compiled
// here: the linker might pick them for machines that have not these instructions.
#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "collision/kernels/forms.hpp"
#include "collision/kernels/packs.hpp"

namespace nbd {
namespace {

#include "collision/kernels/lanes_avx2.inl"
// What follows is written in lanes.
#include "collision/kernels/bodies.inl"

}  // namespace

constinit const Kernels kernels_avx2 = make_kernels(InstructionSet::avx2);

}  // namespace nbd
