#pragma once

#include <hdf5.h>

#include <mutex>
#include <string>
#include <utility>

#include "meshing/h5/types.hpp"

// For the .cpp files of this folder: what they need of the HDF5 library.
namespace nbd::h5 {

/// Held around every use of HDF5, which is not thread-safe. May be nested. The first one turns HDF5's own
/// error printing off.
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

/// HDF5's innermost reason for its last failure.
std::string last_error();

/// The type in memory, and on disk: little-endian whatever the machine.
hid_t memory_type(Type type);
hid_t file_type(Type type);

/// A fixed-length UTF-8 string type. Strings of variable length would lie in HDF5's global heap, the one
/// structure that has no checksum.
Handle text_type(std::size_t length);

}  // namespace nbd::h5
