#include "sim/blas.hpp"

#include <dlfcn.h>

namespace nbd {
namespace {

template <class Function>
Function loaded(const char* name) noexcept {
    return reinterpret_cast<Function>(dlsym(RTLD_DEFAULT, name));
}

}  // namespace

BlasInfo blas_info() {
    BlasInfo info;
    if (const auto config = loaded<char* (*)()>("openblas_get_config")) {
        info.name = config();
        info.fast = true;
    } else if (loaded<void (*)()>("MKL_Get_Version")) {
        info.name = "MKL";
        info.fast = true;
    } else if (loaded<const char* (*)()>("bli_info_get_version_str")) {
        info.name = "BLIS";
        info.fast = true;
    } else {
        info.name = "unknown";
        info.warning =
            "warning: no optimised BLAS is loaded, so factorisations are many times slower than they could "
            "be; "
            "on Debian: apt-get install libopenblas0-pthread";
    }
    return info;
}

void hold_blas_to_one_thread() noexcept {
    if (const auto set = loaded<void (*)(int)>("openblas_set_num_threads")) set(1);
    if (const auto set = loaded<void (*)(int)>("MKL_Set_Num_Threads")) set(1);
    if (const auto set = loaded<void (*)(int)>("bli_thread_set_num_threads"))
        set(1);  // dim_t fits a register
}

}  // namespace nbd
