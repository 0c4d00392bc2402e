#pragma once

namespace nbd {

/// Which of several processes that were started together this one is.
struct Rank {
    int number = 0, count = 1;
    int on_this_machine = 1;  // how many of them share this machine's cores
};

/// As the launcher says in the environment: mpirun (Open MPI, MPICH, Intel) or srun; alone without one.
/// Results never depend on it.
Rank this_rank();

}  // namespace nbd
