// The kernels for AVX2; this file is compiled for AVX2. Functions of other headers must not be compiled here:
// the linker might choose their AVX2 code for a CPU without AVX2.
#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "collision/kernels/kernels.hpp"
#include "collision/kernels/packs.hpp"

namespace nbd {
namespace {

#include "collision/kernels/lanes_avx2.inl"
// The bodies use the lanes above, so they come second.
#include "collision/kernels/kernels.inl"

}  // namespace

constinit const Kernels kernels_avx2 = make_kernels(InstructionSet::avx2);

}  // namespace nbd
