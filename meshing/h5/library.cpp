#include "meshing/h5/library.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>
#include <stdexcept>

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
    const hid_t types[] = {H5T_NATIVE_FLOAT, H5T_NATIVE_DOUBLE, H5T_NATIVE_INT32, H5T_NATIVE_INT64,
                           H5T_NATIVE_UINT64};
    return types[static_cast<int>(type)];
}

hid_t file_type(Type type) {
    const hid_t types[] = {H5T_IEEE_F32LE, H5T_IEEE_F64LE, H5T_STD_I32LE, H5T_STD_I64LE, H5T_STD_U64LE};
    return types[static_cast<int>(type)];
}

Handle text_type(std::size_t length) {
    Handle type(H5Tcopy(H5T_C_S1));
    H5Tset_size(type.get(), std::max<std::size_t>(length, 1));
    H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
    H5Tset_cset(type.get(), H5T_CSET_UTF8);
    return type;
}

namespace {

/// An open file as HDF5 holds it; HDF5 knows only the base class.
struct OpenFile : H5FD_t {
    DrivenFile* file;
    haddr_t end_of_allocation, end_of_file;
};

OpenFile& self(H5FD_t* base) { return *static_cast<OpenFile*>(base); }
const OpenFile& self(const H5FD_t* base) { return *static_cast<const OpenFile*>(base); }

void keep_first(DrivenFile& file, int error) {
    if (file.error == 0) file.error = error;
}

H5FD_t* open_file(const char*, unsigned, hid_t access, haddr_t) {
    const auto* file = static_cast<DrivenFile* const*>(H5Pget_driver_info(access));
    if (!file) return nullptr;
    struct stat status {};
    if (fstat((*file)->descriptor, &status) != 0) {
        keep_first(**file, errno);
        return nullptr;
    }
    auto* opened = new (std::nothrow) OpenFile{};
    if (!opened) return nullptr;
    opened->file = *file;
    opened->end_of_file = static_cast<haddr_t>(status.st_size);
    return opened;
}

herr_t close_file(H5FD_t* base) {
    delete &self(base);
    return 0;
}

herr_t query(const H5FD_t*, unsigned long* flags) {
    *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_DATA_SIEVE |
             H5FD_FEAT_AGGREGATE_SMALLDATA | H5FD_FEAT_DEFAULT_VFD_COMPATIBLE;
    return 0;
}

haddr_t end_of_allocation(const H5FD_t* base, H5FD_mem_t) { return self(base).end_of_allocation; }

herr_t set_end_of_allocation(H5FD_t* base, H5FD_mem_t, haddr_t end) {
    self(base).end_of_allocation = end;
    return 0;
}

haddr_t end_of_file(const H5FD_t* base, H5FD_mem_t) { return self(base).end_of_file; }

/// Reads beyond the end of the file give zeros: that space is allocated but not written yet.
herr_t read(H5FD_t* base, H5FD_mem_t, hid_t, haddr_t address, std::size_t size, void* buffer) {
    auto* out = static_cast<char*>(buffer);
    while (size > 0) {
        const ssize_t n = pread(self(base).file->descriptor, out, size, address);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
            keep_first(*self(base).file, errno);
            return -1;
        }
        if (n == 0) {
            std::memset(out, 0, size);
            return 0;
        }
        out += n;
        address += static_cast<haddr_t>(n);
        size -= static_cast<std::size_t>(n);
    }
    return 0;
}

herr_t write(H5FD_t* base, H5FD_mem_t, hid_t, haddr_t address, std::size_t size, const void* buffer) {
    OpenFile& opened = self(base);
    const auto* in = static_cast<const char*>(buffer);
    while (size > 0 && opened.file->error == 0) {
        const ssize_t n = pwrite(opened.file->descriptor, in, size, address);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
            keep_first(*opened.file, errno);
            break;
        }
        in += n;
        address += static_cast<haddr_t>(n);
        size -= static_cast<std::size_t>(n);
    }
    opened.end_of_file = std::max(opened.end_of_file, address + size);
    return 0;
}

herr_t truncate(H5FD_t* base, hid_t, hbool_t) {
    OpenFile& opened = self(base);
    if (opened.end_of_file == opened.end_of_allocation) return 0;
    if (opened.file->error == 0 && ftruncate(opened.file->descriptor, opened.end_of_allocation) != 0)
        keep_first(*opened.file, errno);
    opened.end_of_file = opened.end_of_allocation;
    return 0;
}

hid_t driver() {
    static const H5FD_class_t description = [] {
        H5FD_class_t c{};
#ifdef H5FD_CLASS_VERSION  // since HDF5 1.14
        c.version = H5FD_CLASS_VERSION;
        c.value = static_cast<H5FD_class_value_t>(300);  // of those that are not given to anyone
#endif
        c.name = "nbd";
        c.maxaddr = static_cast<haddr_t>(INT64_MAX);
        c.fc_degree = H5F_CLOSE_STRONG;
        c.fapl_size = sizeof(DrivenFile*);
        c.open = open_file;
        c.close = close_file;
        c.query = query;
        c.get_eoa = end_of_allocation;
        c.set_eoa = set_end_of_allocation;
        c.get_eof = end_of_file;
        c.read = read;
        c.write = write;
        c.truncate = truncate;
        const H5FD_mem_t one_list[H5FD_MEM_NTYPES] = H5FD_FLMAP_DICHOTOMY;
        std::ranges::copy(one_list, c.fl_map);
        return c;
    }();
    static const hid_t id = H5FDregister(&description);
    return id;
}

}  // namespace

void set_file_driver(hid_t access, DrivenFile& file) {
    DrivenFile* pointer = &file;
    if (H5Pset_driver(access, driver(), &pointer) < 0)
        throw std::runtime_error("HDF5 refuses the file driver; needed: HDF5 1.10 to 1.14");
}

}  // namespace nbd::h5
