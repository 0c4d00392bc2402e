#pragma once

#include <string>

namespace nbd {

/// The BLAS behind CHOLMOD and ARPACK, as the program was started with it.
struct BlasInfo {
    std::string name;     // the file that CHOLMOD's calls end in, or "unknown"
    bool fast = false;    // that file belongs to an optimised implementation
    std::string warning;  // one line for start-up, empty if fast
};

/// Asks the dynamic linker. A BLAS that it cannot tell counts as slow.
BlasInfo blas_info();

/// Makes a recognised BLAS use one thread from now on, so that sums keep one order on every machine. Does
/// nothing on others. Cheap to repeat.
void hold_blas_to_one_thread() noexcept;

/// While alive, OpenMP regions entered from the thread that made it run on that thread alone: CHOLMOD opens
/// one per supernode, and its results shall not depend on how many threads share them. Pinned to one core the
/// same work took 183 to 186 ms with CHOLMOD's OpenMP and 87 to 92 ms with this; on more cores the gain or
/// loss was not measured. Does nothing where no OpenMP is loaded.
class SerialOpenMP {
 public:
    SerialOpenMP() noexcept;
    ~SerialOpenMP();
    SerialOpenMP(const SerialOpenMP&) = delete;
    SerialOpenMP& operator=(const SerialOpenMP&) = delete;

 private:
    int levels_ = 0;  // OpenMP's limit on nested regions before
};

}  // namespace nbd
