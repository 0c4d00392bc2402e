// The kernels for NEON, which every 64-bit Arm CPU has.
#include <arm_neon.h>

#include <cstddef>
#include <cstdint>

#include "collision/kernels/kernels.hpp"
#include "collision/kernels/packs.hpp"

namespace nbd {
namespace {

#include "collision/kernels/lanes_neon.inl"
// The bodies use the lanes above, so they come second.
#include "collision/kernels/kernels.inl"

}  // namespace

constinit const Kernels kernels_neon = make_kernels(InstructionSet::neon);

}  // namespace nbd
