#include "meshing/h5/library.hpp"

#include <algorithm>

namespace nbd::h5 {

namespace {

std::recursive_mutex mutex;

herr_t keep_description(unsigned, const H5E_error2_t* error, void* text) {
    if (error->desc && *error->desc) *static_cast<std::string*>(text) = error->desc;
    return 0;
}

}  // namespace

/// Each thread has its own stack of errors, which HDF5 prints unless that thread says no.
LibraryLock::LibraryLock() : lock_(mutex) {
    thread_local const bool quiet = H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr) >= 0;
    static_cast<void>(quiet);
}

std::string last_error() {
    std::string text = "HDF5 gives no reason";
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_DOWNWARD, keep_description, &text);
    std::ranges::replace(text, '\n', ' ');
    return text;
}

hid_t memory_type(Type type) {
    switch (type) {
        case Type::float32:
            return H5T_NATIVE_FLOAT;
        case Type::float64:
            return H5T_NATIVE_DOUBLE;
        case Type::int32:
            return H5T_NATIVE_INT32;
        case Type::int64:
            return H5T_NATIVE_INT64;
        case Type::uint64:
            return H5T_NATIVE_UINT64;
    }
    return H5I_INVALID_HID;
}

hid_t file_type(Type type) {
    switch (type) {
        case Type::float32:
            return H5T_IEEE_F32LE;
        case Type::float64:
            return H5T_IEEE_F64LE;
        case Type::int32:
            return H5T_STD_I32LE;
        case Type::int64:
            return H5T_STD_I64LE;
        case Type::uint64:
            return H5T_STD_U64LE;
    }
    return H5I_INVALID_HID;
}

Handle text_type(std::size_t length) {
    Handle type(H5Tcopy(H5T_C_S1));
    H5Tset_size(type.get(), std::max<std::size_t>(length, 1));
    H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
    H5Tset_cset(type.get(), H5T_CSET_UTF8);
    return type;
}

}  // namespace nbd::h5
