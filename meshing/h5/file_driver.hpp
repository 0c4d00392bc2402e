#pragma once

#include <hdf5.h>

namespace nbd::h5 {

/// An open file that HDF5 reads or writes through this driver.
struct DrivenFile {
    int descriptor = -1;
    int error = 0;  // errno of the first failed read or write; 0 if none
};

/// Makes the file access list `access` read and write `file`, which must outlive the HDF5 file.
///
/// HDF5 1.10 cannot close a file after a failed write, and crashes at program exit (seen on a full disk).
/// After a failed write this driver therefore accepts and drops all further writes, so that the library can
/// shut down; the caller checks `error`.
void set_file_driver(hid_t access, DrivenFile& file);

}  // namespace nbd::h5
