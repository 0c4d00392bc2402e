#pragma once

#include <mpi.h>

namespace nbd {

/// MPI of one process, which hypre and Trilinos want. It stays until the program ends.
struct SerialMpi {
    SerialMpi() {
        int ready = 0;
        MPI_Initialized(&ready);
        if (!ready) MPI_Init(nullptr, nullptr);
    }
};

}  // namespace nbd
