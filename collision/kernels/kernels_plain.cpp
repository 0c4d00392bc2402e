// The kernels for the instruction set that the library is compiled for.
#include <cstddef>
#include <cstdint>

#include "collision/kernels/kernels.hpp"
#include "collision/kernels/packs.hpp"

namespace nbd {
namespace {

#include "collision/kernels/lanes_plain.inl"
// The bodies use the lanes above, so they come second.
#include "collision/kernels/kernels.inl"

}  // namespace

constinit const Kernels kernels_plain = make_kernels(InstructionSet::plain);

}  // namespace nbd
