// The kernels for what the library is compiled for.
#include <cstddef>
#include <cstdint>

#include "collision/kernels/forms.hpp"
#include "collision/kernels/packs.hpp"

namespace nbd {
namespace {

#include "collision/kernels/lanes_plain.inl"
// What follows is written in lanes.
#include "collision/kernels/bodies.inl"

}  // namespace

constinit const Kernels kernels_plain = make_kernels(InstructionSet::plain);

}  // namespace nbd
