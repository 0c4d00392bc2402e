#pragma once

#include <string>

namespace nbd {

/// The BLAS behind CHOLMOD and ARPACK, as the program was started with it.
struct BlasInfo {
    std::string name;     // e.g. "OpenBLAS 0.3.21 ..."; "unknown" for one that does not say
    bool fast = false;    // an optimised implementation was recognised
    std::string warning;  // one line for start-up, empty if fast
};

/// Asks the loaded libraries. Never throws on a BLAS it does not know.
BlasInfo blas_info();

/// Makes a recognised BLAS use one thread from now on, so that sums keep one order on every machine. Does
/// nothing on others. Cheap to repeat.
void hold_blas_to_one_thread() noexcept;

}  // namespace nbd
