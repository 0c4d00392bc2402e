#pragma once

#include <string>

namespace nbd {

/// The BLAS behind CHOLMOD and ARPACK in the running program.
struct BlasInfo {
    std::string name;     // file that implements CHOLMOD's calls, or "unknown"
    bool fast = false;    // whether that file is an optimised implementation
    std::string warning;  // one line for start-up; empty if fast
};

/// Asks the dynamic linker. An unrecognised BLAS counts as slow.
BlasInfo blas_info();

/// Limits a recognised BLAS to one thread from now on, so that sums keep the same order on every machine.
/// Does nothing for others. Cheap to repeat.
void hold_blas_to_one_thread() noexcept;

/// The last object of this class to be destroyed gives a recognised BLAS the number of threads that it had
/// when the first was made: for programs that use it for other things, too. Any thread may make one.
class RestoredBlasThreads {
 public:
    RestoredBlasThreads() noexcept;
    ~RestoredBlasThreads();
    RestoredBlasThreads(const RestoredBlasThreads&) = delete;
    RestoredBlasThreads& operator=(const RestoredBlasThreads&) = delete;
};

/// While alive, OpenMP regions entered from the constructing thread run on that thread only. CHOLMOD opens
/// one region per supernode, and its results must not depend on the number of threads. On one core the same
/// work took 183 to 186 ms with CHOLMOD's OpenMP and 87 to 92 ms with this class; more cores were not
/// measured. Does nothing if OpenMP is not loaded.
class SerialOpenMP {
 public:
    SerialOpenMP() noexcept;
    ~SerialOpenMP();
    SerialOpenMP(const SerialOpenMP&) = delete;
    SerialOpenMP& operator=(const SerialOpenMP&) = delete;

 private:
    int levels_ = 0;  // OpenMP's previous limit on nested regions
};

}  // namespace nbd
