// The kernels for AVX-512 (F, BW, DQ, VL, VNNI); this file is compiled for it. Functions of other headers
// must not be compiled here: the linker might choose their AVX-512 code for a CPU without it.
#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "collision/kernels/kernels.hpp"
#include "collision/kernels/packs.hpp"

namespace nbd {
namespace {

#include "collision/kernels/lanes_avx512.inl"
// The bodies use the lanes above, so they come second.
#include "collision/kernels/kernels.inl"

}  // namespace

constinit const Kernels kernels_avx512 = make_kernels(InstructionSet::avx512);

}  // namespace nbd
