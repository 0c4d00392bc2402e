#include "meshing/h5/opened_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace nbd::h5 {

namespace {

constexpr const char* ours = "a file written by nbdtree";
constexpr const char* whole = "a complete file written by nbdtree";

/// Whether the file begins as HDF5 files do. A failed read leaves its error in `file`.
bool read_signature(DrivenFile& file) {
    static constexpr std::array<unsigned char, 8> signature = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
    std::array<unsigned char, 8> bytes{};
    ssize_t count = 0;
    do count = pread(file.descriptor, bytes.data(), bytes.size(), 0);
    while (count < 0 && errno == EINTR);
    if (count < 0) file.error = errno;
    return count == static_cast<ssize_t>(bytes.size()) && bytes == signature;
}

std::string quoted(const std::string& object, const std::string& name) {
    return object == "/" ? fmt::format("attribute '{}'", name)
                         : fmt::format("attribute '{}' of '{}'", name, object);
}

/// Reads a string of type `type` by `read(memory_type, buffer)`. Returns false if the read fails.
template <class Read>
bool read_string(hid_t type, const Read& read, std::string& text) {
    if (H5Tis_variable_str(type) > 0) {
        const Handle memory(H5Tcopy(H5T_C_S1));
        H5Tset_size(memory.get(), H5T_VARIABLE);
        H5Tset_cset(memory.get(), H5Tget_cset(type));
        char* value = nullptr;
        if (read(memory.get(), &value) < 0) return false;
        text = value ? value : "";
        H5free_memory(value);
        return true;
    }
    text.assign(H5Tget_size(type), '\0');
    if (read(type, text.data()) < 0) return false;
    text.erase(text.find_last_not_of('\0') + 1);
    return true;
}

bool is_one_string(hid_t type, hid_t space) {
    return H5Tget_class(type) == H5T_STRING && H5Sget_simple_extent_npoints(space) == 1;
}

}  // namespace

OpenedFile::OpenedFile(const std::filesystem::path& path) : path_(path) {
    struct stat status {};
    if (stat(path.c_str(), &status) != 0) {
        if (errno == ENOENT || errno == ENOTDIR)
            throw std::runtime_error(fmt::format("{}: no such file", path.string()));
        driven_.error = errno;
        check_reads();
    }
    if (S_ISDIR(status.st_mode)) refuse("is a folder", ours);
    if (!S_ISREG(status.st_mode)) refuse("is not a regular file", ours);
    if (status.st_size == 0) refuse("is empty", ours);
    bytes_ = status.st_size;
    driven_.descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (driven_.descriptor < 0) driven_.error = errno;
    check_reads();
    try {
        const bool has_ours = read_signature(driven_);
        check_reads();
        if (!has_ours) refuse("is not an HDF5 file", ours);
        const LibraryLock lock;
        const Handle access(H5Pcreate(H5P_FILE_ACCESS));
        set_file_driver(access.get(), driven_);
        H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG);
        file_ = Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.get()));
        check_reads();
        if (!file_) refuse(fmt::format("is truncated or damaged: {}", last_error()), whole);
        const htri_t has_format = H5Aexists(file_.get(), "format");
        check_reads();
        if (has_format <= 0) refuse("is an HDF5 file without attribute 'format'", ours);
        format_.name = text_attribute("/", "format");
        std::int64_t version = 0;
        number_attribute("/", "format_version", Type::int64, &version);
        if (version < 1 || version > INT32_MAX)
            refuse(fmt::format("has format_version {}", version), "a positive number");
        format_.version = version;
    } catch (...) {
        const LibraryLock lock;
        file_ = Handle();
        close(driven_.descriptor);
        throw;
    }
}

OpenedFile::~OpenedFile() {
    const LibraryLock lock;
    file_ = Handle();
    close(driven_.descriptor);
}

void OpenedFile::refuse(const std::string& what, const std::string& allowed) const {
    throw std::runtime_error(fmt::format("{}: {}; allowed: {}", path_.string(), what, allowed));
}

void OpenedFile::check_reads() const {
    if (driven_.error != 0)
        throw ReadError(fmt::format("{}: cannot be read: {}", path_.string(), std::strerror(driven_.error)));
}

void OpenedFile::refuse_damaged(const std::string& item) const {
    check_reads();
    refuse(fmt::format("{} is damaged: {}", item, last_error()), whole);
}

bool OpenedFile::has(const std::string& name) const {
    if (name == "/") return true;
    for (std::size_t end = 0; end != std::string::npos;) {  // check each parent group, then the name itself
        end = name.find('/', end + 1);
        const std::string prefix = name.substr(0, end);
        const htri_t there = H5Lexists(file_.get(), prefix.c_str(), H5P_DEFAULT);
        if (there < 0) refuse_damaged(fmt::format("'{}'", prefix));
        if (there == 0) return false;
        H5L_info_t link{};
        if (H5Lget_info(file_.get(), prefix.c_str(), &link, H5P_DEFAULT) < 0)
            refuse_damaged(fmt::format("'{}'", prefix));
        if (link.type == H5L_TYPE_EXTERNAL) refuse(fmt::format("'{}' is in another file", prefix), whole);
    }
    return true;
}

Handle OpenedFile::open_object(const std::string& name) const {
    if (!has(name)) refuse(fmt::format("has no '{}'", name), "a file with this item");
    Handle object(H5Oopen(file_.get(), name.c_str(), H5P_DEFAULT));
    if (!object) refuse_damaged(fmt::format("'{}'", name));
    return object;
}

Handle OpenedFile::open_dataset(const std::string& name) const {
    Handle object = open_object(name);
    if (H5Iget_type(object.get()) != H5I_DATASET)
        refuse(fmt::format("'{}' is not a dataset", name), "a dataset");
    const Handle creation(H5Dget_create_plist(object.get()));
    if (H5Pget_external_count(creation.get()) > 0)
        refuse(fmt::format("the numbers of '{}' are in another file", name), whole);
    return object;
}

Handle OpenedFile::open_attribute(const std::string& object, const std::string& name) const {
    const Handle target = open_object(object);
    const htri_t there = H5Aexists(target.get(), name.c_str());
    if (there < 0) refuse_damaged(quoted(object, name));
    if (there == 0) refuse(fmt::format("has no {}", quoted(object, name)), "a file with this item");
    Handle attribute(H5Aopen(target.get(), name.c_str(), H5P_DEFAULT));
    if (!attribute) refuse_damaged(quoted(object, name));
    return attribute;
}

std::string OpenedFile::text_attribute(const std::string& object, const std::string& name) const {
    const Handle attribute = open_attribute(object, name);
    const Handle type(H5Aget_type(attribute.get())), space(H5Aget_space(attribute.get()));
    if (!is_one_string(type.get(), space.get()))
        refuse(fmt::format("{} is not a text", quoted(object, name)), "one string");
    if (H5Tget_size(type.get()) > bytes_)
        refuse(fmt::format("{} is longer than the file", quoted(object, name)), whole);
    std::string text;
    const auto read = [&](hid_t memory, void* out) { return H5Aread(attribute.get(), memory, out); };
    if (!read_string(type.get(), read, text)) refuse_damaged(quoted(object, name));
    return text;
}

std::string OpenedFile::text_dataset(const std::string& name) const {
    const Handle dataset = open_dataset(name);
    const Handle type(H5Dget_type(dataset.get())), space(H5Dget_space(dataset.get()));
    if (!is_one_string(type.get(), space.get()))
        refuse(fmt::format("'{}' is not a text", name), "one string");
    if (H5Tget_size(type.get()) > bytes_) refuse(fmt::format("'{}' is longer than the file", name), whole);
    std::string text;
    const auto read = [&](hid_t memory, void* out) {
        return H5Dread(dataset.get(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, out);
    };
    if (!read_string(type.get(), read, text)) refuse_damaged(fmt::format("'{}'", name));
    return text;
}

void OpenedFile::number_attribute(const std::string& object, const std::string& name, Type type,
                                  void* value) const {
    const Handle attribute = open_attribute(object, name);
    const Handle stored(H5Aget_type(attribute.get())), space(H5Aget_space(attribute.get()));
    const H5T_class_t kind = H5Tget_class(stored.get());
    const bool fits = kind == H5T_INTEGER || (type == Type::float64 && kind == H5T_FLOAT);
    if (!fits || H5Sget_simple_extent_npoints(space.get()) != 1)
        refuse(fmt::format("{} is not {}", quoted(object, name),
                           type == Type::float64 ? "a number" : "a whole number"),
               fmt::format("one {}", h5::name(type)));
    if (H5Aread(attribute.get(), memory_type(type), value) < 0) refuse_damaged(quoted(object, name));
}

}  // namespace nbd::h5
