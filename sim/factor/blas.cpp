#include "sim/factor/blas.hpp"

#include <dlfcn.h>

#include <filesystem>
#include <system_error>

namespace nbd {
namespace {

template <class Function>
Function loaded(const char* name) noexcept {
    return reinterpret_cast<Function>(dlsym(RTLD_DEFAULT, name));
}

}  // namespace

BlasInfo blas_info() {
    BlasInfo info{.name = "unknown", .fast = false, .warning = {}};
    // Finds the file that CHOLMOD's calls reach; an optimised BLAS may be loaded for other callers only.
    Dl_info where{};
    if (void* gemm = dlsym(RTLD_DEFAULT, "dgemm_"); gemm && dladdr(gemm, &where) && where.dli_fname) {
        std::error_code ignored;
        const std::string file = std::filesystem::canonical(where.dli_fname, ignored).string();
        info.name = file.empty() ? where.dli_fname : file;
    }
    for (const char* known : {"openblas", "mkl", "blis", "atlas", "flexiblas"})
        info.fast = info.fast || info.name.find(known) != std::string::npos;
    if (!info.fast)
        info.warning =
            "warning: factorisations are several times slower than with an optimised BLAS; BLAS is " +
            info.name + "; on Debian: apt-get install libopenblas0-pthread";
    return info;
}

void hold_blas_to_one_thread() noexcept {
    if (const auto set = loaded<void (*)(int)>("openblas_set_num_threads")) set(1);
    if (const auto set = loaded<void (*)(int)>("MKL_Set_Num_Threads")) set(1);
    if (const auto set = loaded<void (*)(int)>("bli_thread_set_num_threads"))
        set(1);  // int: dim_t fits a register
}

SerialOpenMP::SerialOpenMP() noexcept {
    if (const auto get = loaded<int (*)()>("omp_get_max_active_levels")) levels_ = get();
    if (const auto set = loaded<void (*)(int)>("omp_set_max_active_levels")) set(0);
}

SerialOpenMP::~SerialOpenMP() {
    if (const auto set = loaded<void (*)(int)>("omp_set_max_active_levels")) set(levels_);
}

}  // namespace nbd
