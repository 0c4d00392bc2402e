#pragma once

#include <hdf5.h>

namespace nbd::h5 {

/// An open file that HDF5 reads or writes through our driver.
struct DrivenFile {
    int descriptor = -1;
    int error = 0;  // errno of the first read or write that failed
};

/// Makes `access` (a file access list) read and write `file`, which must outlive the HDF5 file.
///
/// HDF5 1.10 cannot close a file that it can no longer write, and crashes at the end of the program with
/// it (seen on a full disk). So once a write has failed, this driver takes and drops whatever else comes:
/// the library winds down in order, and the caller looks at `error`.
void set_file_driver(hid_t access, DrivenFile& file);

}  // namespace nbd::h5
