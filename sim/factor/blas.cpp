#include "sim/factor/blas.hpp"

#include <dlfcn.h>

#include <array>
#include <filesystem>
#include <mutex>
#include <system_error>

namespace nbd {
namespace {

template <class Function>
Function loaded(const char* name) noexcept {
    return reinterpret_cast<Function>(dlsym(RTLD_DEFAULT, name));
}

/// How each recognised BLAS tells and sets its number of threads; an int fits the register of any type used.
struct ThreadCount {
    const char *get, *set;
};
constexpr std::array<ThreadCount, 3> thread_counts{
    {{"openblas_get_num_threads", "openblas_set_num_threads"},
     {"MKL_Get_Max_Threads", "MKL_Set_Num_Threads"},
     {"bli_thread_get_num_threads", "bli_thread_set_num_threads"}}};

std::mutex restored;
int restorers = 0;
std::array<int, thread_counts.size()> threads_before{};  // 0: not loaded

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
        info.warning = "factorisations are several times slower than with an optimised BLAS; BLAS is " +
                       info.name + "; on Debian: apt-get install libopenblas0-pthread";
    return info;
}

void hold_blas_to_one_thread() noexcept {
    for (const ThreadCount& threads : thread_counts)
        if (const auto set = loaded<void (*)(int)>(threads.set)) set(1);
}

RestoredBlasThreads::RestoredBlasThreads() noexcept {
    const std::scoped_lock lock(restored);
    if (restorers++ > 0) return;
    for (std::size_t i = 0; i < thread_counts.size(); ++i) {
        const auto get = loaded<int (*)()>(thread_counts[i].get);
        threads_before[i] = get ? get() : 0;
    }
}

RestoredBlasThreads::~RestoredBlasThreads() {
    const std::scoped_lock lock(restored);
    if (--restorers > 0) return;
    for (std::size_t i = 0; i < thread_counts.size(); ++i)
        if (const auto set = loaded<void (*)(int)>(thread_counts[i].set); set && threads_before[i] > 0)
            set(threads_before[i]);
}

SerialOpenMP::SerialOpenMP() noexcept {
    if (const auto get = loaded<int (*)()>("omp_get_max_active_levels")) levels_ = get();
    if (const auto set = loaded<void (*)(int)>("omp_set_max_active_levels")) set(0);
}

SerialOpenMP::~SerialOpenMP() {
    if (const auto set = loaded<void (*)(int)>("omp_set_max_active_levels")) set(levels_);
}

}  // namespace nbd
