#pragma once

#include <hdf5.h>

#include <mutex>
#include <string>
#include <utility>

#include "meshing/h5/types.hpp"

// HDF5 helpers for the .cpp files of this folder.
namespace nbd::h5 {

/// Lock to hold during every use of HDF5, which is not thread-safe. Recursive. The first lock of each
/// thread turns off HDF5's own error printing.
class LibraryLock {
 public:
    LibraryLock();

 private:
    std::scoped_lock<std::recursive_mutex> lock_;
};

/// Owns an HDF5 identifier of any kind.
class Handle {
 public:
    Handle() = default;
    explicit Handle(hid_t id) noexcept : id_(id) {}
    ~Handle() {
        if (id_ >= 0) H5Idec_ref(id_);
    }
    Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)) {}
    Handle& operator=(Handle&& other) noexcept {
        std::swap(id_, other.id_);
        return *this;
    }
    hid_t get() const noexcept { return id_; }
    hid_t release() noexcept { return std::exchange(id_, H5I_INVALID_HID); }
    explicit operator bool() const noexcept { return id_ >= 0; }

 private:
    hid_t id_ = H5I_INVALID_HID;
};

/// The innermost reason that HDF5 gives for its last failure.
std::string last_error();

/// HDF5 types in memory and on disk; on disk always little-endian.
hid_t memory_type(Type type);
hid_t file_type(Type type);

/// A fixed-length UTF-8 string type. Variable-length strings would go to HDF5's global heap, the only
/// structure without a checksum.
Handle text_type(std::size_t length);

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
