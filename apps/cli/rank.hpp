#pragma once

namespace nbd {

/// Rank of this process among processes that were started together.
struct Rank {
    int number = 0, count = 1;
    int on_this_machine = 1;  // number of them that share this machine's cores
};

/// The rank that the launcher sets in the environment: mpirun (Open MPI, MPICH, Intel) or srun; a single
/// process without a launcher. Results never depend on it.
Rank this_rank();

}  // namespace nbd
