#include "meshing/h5/reader_impl.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

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

/// Reads the one string of a dataset or an attribute by `read(memory_type, buffer)`. item: for errors.
template <class Read>
std::string read_string(const Reader::Impl& file, const Handle& type, const Handle& space,
                        const std::string& item, const Read& read) {
    if (H5Tget_class(type.get()) != H5T_STRING || H5Sget_simple_extent_npoints(space.get()) != 1)
        file.refuse(fmt::format("{} is not a text", item), "one string");
    if (H5Tget_size(type.get()) > file.bytes)
        file.refuse(fmt::format("{} is longer than the file", item), whole);
    if (H5Tis_variable_str(type.get()) > 0) {
        const Handle memory(H5Tcopy(H5T_C_S1));
        H5Tset_size(memory.get(), H5T_VARIABLE);
        H5Tset_cset(memory.get(), H5Tget_cset(type.get()));
        char* value = nullptr;
        if (read(memory.get(), &value) < 0) file.refuse_damaged(item);
        const std::string text = value ? value : "";
        H5free_memory(value);
        return text;
    }
    std::string text(H5Tget_size(type.get()), '\0');
    if (read(type.get(), text.data()) < 0) file.refuse_damaged(item);
    text.erase(text.find_last_not_of('\0') + 1);
    return text;
}

}  // namespace

Reader::Impl::Impl(const std::filesystem::path& given) : path(given) {
    struct stat status {};
    if (stat(path.c_str(), &status) != 0) {
        if (errno == ENOENT || errno == ENOTDIR)
            throw std::runtime_error(fmt::format("{}: no such file", path.string()));
        driven.error = errno;
        check_reads();
    }
    if (S_ISDIR(status.st_mode)) refuse("is a folder", ours);
    if (!S_ISREG(status.st_mode)) refuse("is not a regular file", ours);
    if (status.st_size == 0) refuse("is empty", ours);
    bytes = status.st_size;
    driven.descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (driven.descriptor < 0) driven.error = errno;
    check_reads();
    try {
        const bool has_ours = read_signature(driven);
        check_reads();
        if (!has_ours) refuse("is not an HDF5 file", ours);
        const LibraryLock lock;
        const Handle access(H5Pcreate(H5P_FILE_ACCESS));
        set_file_driver(access.get(), driven);
        H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG);
        file = Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.get()));
        check_reads();
        if (!file) refuse(fmt::format("is truncated or damaged: {}", last_error()), whole);
        const htri_t has_format = H5Aexists(file.get(), "format");
        check_reads();
        if (has_format <= 0) refuse("is an HDF5 file without attribute 'format'", ours);
        format.name = text_attribute("/", "format");
        std::int64_t version = 0;
        number_attribute("/", "format_version", Type::int64, &version);
        if (version < 1 || version > INT32_MAX)
            refuse(fmt::format("has format_version {}", version), "a positive number");
        format.version = version;
    } catch (...) {
        const LibraryLock lock;
        file = Handle();
        close(driven.descriptor);
        throw;
    }
}

Reader::Impl::~Impl() {
    const LibraryLock lock;
    kept = Handle();
    file = Handle();
    close(driven.descriptor);
}

void Reader::Impl::refuse(const std::string& what, const std::string& allowed) const {
    throw std::runtime_error(fmt::format("{}: {}; allowed: {}", path.string(), what, allowed));
}

void Reader::Impl::check_reads() const {
    if (driven.error != 0)
        throw ReadError(fmt::format("{}: cannot be read: {}", path.string(), std::strerror(driven.error)));
}

void Reader::Impl::refuse_damaged(const std::string& item) const {
    check_reads();
    refuse(fmt::format("{} is damaged: {}", item, last_error()), whole);
}

bool Reader::Impl::has(const std::string& name) const {
    if (name == "/") return true;
    const LibraryLock lock;
    for (std::size_t end = 0; end != std::string::npos;) {  // check each parent group, then the name itself
        end = name.find('/', end + 1);
        const std::string prefix = name.substr(0, end);
        const htri_t there = H5Lexists(file.get(), prefix.c_str(), H5P_DEFAULT);
        if (there < 0) refuse_damaged(fmt::format("'{}'", prefix));
        if (there == 0) return false;
        H5L_info_t link{};
        if (H5Lget_info(file.get(), prefix.c_str(), &link, H5P_DEFAULT) < 0)
            refuse_damaged(fmt::format("'{}'", prefix));
        if (link.type == H5L_TYPE_EXTERNAL) refuse(fmt::format("'{}' is in another file", prefix), whole);
    }
    return true;
}

Handle Reader::Impl::open_object(const std::string& name) const {
    if (!has(name)) refuse(fmt::format("has no '{}'", name), "a file with this item");
    Handle object(H5Oopen(file.get(), name.c_str(), H5P_DEFAULT));
    if (!object) refuse_damaged(fmt::format("'{}'", name));
    return object;
}

Handle Reader::Impl::open_dataset(const std::string& name) const {
    Handle object = open_object(name);
    if (H5Iget_type(object.get()) != H5I_DATASET)
        refuse(fmt::format("'{}' is not a dataset", name), "a dataset");
    const Handle creation(H5Dget_create_plist(object.get()));
    if (H5Pget_external_count(creation.get()) > 0)
        refuse(fmt::format("the numbers of '{}' are in another file", name), whole);
    return object;
}

Handle Reader::Impl::open_attribute(const std::string& object, const std::string& name) const {
    const Handle target = open_object(object);
    const htri_t there = H5Aexists(target.get(), name.c_str());
    if (there < 0) refuse_damaged(quoted(object, name));
    if (there == 0) refuse(fmt::format("has no {}", quoted(object, name)), "a file with this item");
    Handle attribute(H5Aopen(target.get(), name.c_str(), H5P_DEFAULT));
    if (!attribute) refuse_damaged(quoted(object, name));
    return attribute;
}

std::string Reader::Impl::text_attribute(const std::string& object, const std::string& name) const {
    const LibraryLock lock;
    const Handle attribute = open_attribute(object, name);
    const Handle type(H5Aget_type(attribute.get())), space(H5Aget_space(attribute.get()));
    return read_string(*this, type, space, quoted(object, name),
                       [&](hid_t memory, void* out) { return H5Aread(attribute.get(), memory, out); });
}

std::string Reader::Impl::text_dataset(const std::string& name) const {
    const LibraryLock lock;
    const Handle dataset = open_dataset(name);
    const Handle type(H5Dget_type(dataset.get())), space(H5Dget_space(dataset.get()));
    return read_string(*this, type, space, fmt::format("'{}'", name), [&](hid_t memory, void* out) {
        return H5Dread(dataset.get(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, out);
    });
}

void Reader::Impl::number_attribute(const std::string& object, const std::string& name, Type type,
                                    void* value) const {
    const LibraryLock lock;
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
