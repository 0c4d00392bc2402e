#include "collision/kernels/kernels.hpp"

#include <atomic>

namespace nbd {

const Kernels* kernels_for(InstructionSet instructions) noexcept {
    switch (instructions) {
#ifdef NBD_X86_KERNELS
        case InstructionSet::avx2:
            return __builtin_cpu_supports("avx2") ? &kernels_avx2 : nullptr;
        case InstructionSet::avx512:
            return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
                           __builtin_cpu_supports("avx512vnni")
                       ? &kernels_avx512
                       : nullptr;
#endif
#ifdef NBD_ARM_KERNELS
        case InstructionSet::neon:
            return &kernels_neon;
#endif
        case InstructionSet::plain:
            return &kernels_plain;
        default:
            return nullptr;
    }
}

namespace {

std::atomic<const Kernels*> in_use = nullptr;

}  // namespace

const Kernels& kernels() noexcept {
    if (const Kernels* chosen = in_use.load(std::memory_order_relaxed)) return *chosen;
    const Kernels* best = &kernels_plain;
    for (const InstructionSet set : instruction_sets)
        if (const Kernels* form = kernels_for(set)) best = form;
    const Kernels* none = nullptr;
    in_use.compare_exchange_strong(none, best, std::memory_order_relaxed);
    return *in_use.load(std::memory_order_relaxed);
}

void use_kernels(const Kernels& form) noexcept { in_use.store(&form, std::memory_order_relaxed); }

const char* name(InstructionSet instructions) noexcept {
    switch (instructions) {
        case InstructionSet::avx2:
            return "avx2";
        case InstructionSet::avx512:
            return "avx512";
        case InstructionSet::neon:
            return "neon";
        default:
            return "plain";
    }
}

}  // namespace nbd
