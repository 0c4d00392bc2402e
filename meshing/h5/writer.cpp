#include "meshing/h5/writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <stdexcept>

#include "collision/base/temporary_files.hpp"
#include "meshing/h5/library.hpp"
#include "meshing/h5/version.hpp"

namespace nbd::h5 {

namespace {

constexpr std::size_t chunk_bytes = 1 << 20;
constexpr std::size_t longest_attribute = 32 << 10;  // HDF5 can keep 64 KiB in a checksummed header

Handle without_times(hid_t property_class) {
    Handle list(H5Pcreate(property_class));
    H5Pset_obj_track_times(list.get(), false);
    return list;
}

std::vector<hsize_t> dimensions(const Shape& shape) { return {shape.begin(), shape.end()}; }

Handle simple_space(const Shape& shape) {
    const auto d = dimensions(shape);
    return Handle(H5Screate_simple(d.size(), d.data(), nullptr));
}

/// Chunks of about `chunk_bytes` over the first axis, all of nearly one size.
Shape chunk_of(const Shape& shape, std::size_t element_size) {
    const std::size_t bytes = element_count(shape) * element_size;
    const std::size_t chunks = std::clamp<std::size_t>((bytes + chunk_bytes - 1) / chunk_bytes, 1, shape[0]);
    Shape chunk = shape;
    chunk[0] = (shape[0] + chunks - 1) / chunks;
    return chunk;
}

Handle chunked(const Shape& chunk, Packing packing) {
    Handle list = without_times(H5P_DATASET_CREATE);
    const auto d = dimensions(chunk);
    H5Pset_chunk(list.get(), d.size(), d.data());
    if (packing == Packing::deflate) {
        H5Pset_shuffle(list.get());
        H5Pset_deflate(list.get(), 4);
    }
    H5Pset_fletcher32(list.get());  // last, so that a reader verifies before it unpacks
    return list;
}

struct Growing {
    std::string name;
    Type type;
    Shape row;
    std::size_t rows = 0;
    Handle dataset;
};

}  // namespace

struct Writer::Impl {
    TemporaryFile temporary;
    DrivenFile driven;
    Handle file;
    std::map<int, Growing> growing;
    int next_handle = 0;

    explicit Impl(const std::filesystem::path& path) : temporary(path) {}
    ~Impl() {
        const LibraryLock lock;
        growing.clear();
        file = Handle();
    }

    /// Throws if the last call failed (`ok` is its result), or the disk write behind it.
    void check(bool ok, const std::string& what) const {
        const std::string path = temporary.path().string();
        if (driven.error != 0)
            throw std::runtime_error(fmt::format("{}: cannot write: {}", path, std::strerror(driven.error)));
        if (!ok) throw std::runtime_error(fmt::format("{}: cannot write '{}': {}", path, what, last_error()));
    }

    void make_group(const std::string& name) {
        if (H5Lexists(file.get(), name.c_str(), H5P_DEFAULT) > 0) return;
        make_parent(name);
        const Handle list = without_times(H5P_GROUP_CREATE);
        const Handle made(H5Gcreate2(file.get(), name.c_str(), H5P_DEFAULT, list.get(), H5P_DEFAULT));
        check(static_cast<bool>(made), name);
    }

    void make_parent(const std::string& name) {
        const std::size_t slash = name.rfind('/');
        if (slash != std::string::npos && slash > 0) make_group(name.substr(0, slash));
    }

    Handle make_dataset(const std::string& name, hid_t type, hid_t space, hid_t creation, hid_t access) {
        make_parent(name);
        Handle made(H5Dcreate2(file.get(), name.c_str(), type, space, H5P_DEFAULT, creation, access));
        check(static_cast<bool>(made), name);
        return made;
    }

    void add_attribute(const std::string& object, const std::string& name, hid_t file_type, hid_t memory_type,
                       const void* value) {
        const std::string what = fmt::format("{}@{}", object, name);
        const Handle target(H5Oopen(file.get(), object.c_str(), H5P_DEFAULT));
        check(static_cast<bool>(target), what);
        const Handle space(H5Screate(H5S_SCALAR));
        const Handle made(
            H5Acreate2(target.get(), name.c_str(), file_type, space.get(), H5P_DEFAULT, H5P_DEFAULT));
        check(made && H5Awrite(made.get(), memory_type, value) >= 0, what);
    }

    Growing& at(int handle) {
        const auto found = growing.find(handle);
        if (found == growing.end())
            throw std::logic_error(
                fmt::format("{}: no growing dataset has handle {}", temporary.path().string(), handle));
        return found->second;
    }
};

Writer::Writer(const std::filesystem::path& path, const Format& format)
    : impl_(std::make_unique<Impl>(path)) {
    {
        const LibraryLock lock;
        impl_->driven.descriptor = impl_->temporary.descriptor();
        const Handle access(H5Pcreate(H5P_FILE_ACCESS)), creation = without_times(H5P_FILE_CREATE);
        set_file_driver(access.get(), impl_->driven);
        H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG);
        H5Pset_libver_bounds(access.get(), H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);  // checksummed metadata
        impl_->file =
            Handle(H5Fcreate(impl_->temporary.path().c_str(), H5F_ACC_TRUNC, creation.get(), access.get()));
        impl_->check(static_cast<bool>(impl_->file), "/");
    }
    attribute("/", "format", format.name);
    attribute("/", "format_version", format.version);
    attribute("/", "program_version", build_version());
    attribute("/", "units", "m, s, kg");
}

Writer::~Writer() = default;
Writer::Writer(Writer&&) noexcept = default;

const std::filesystem::path& Writer::path() const noexcept { return impl_->temporary.path(); }

void Writer::group(const std::string& name) {
    const LibraryLock lock;
    impl_->make_group(name);
}

void Writer::write_values(const std::string& name, Type type, const Shape& shape, const void* values,
                          std::size_t count, Packing packing) {
    if (shape.empty() || count != element_count(shape))
        throw std::logic_error(fmt::format("'{}' is {} but has {} values", name, text(shape), count));
    const LibraryLock lock;
    const Handle creation =
        count == 0 ? without_times(H5P_DATASET_CREATE) : chunked(chunk_of(shape, size_of(type)), packing);
    const Handle dataset =
        impl_->make_dataset(name, file_type(type), simple_space(shape).get(), creation.get(), H5P_DEFAULT);
    const bool written =
        count == 0 || H5Dwrite(dataset.get(), memory_type(type), H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0;
    impl_->check(written, name);
}

void Writer::write_text(const std::string& name, std::string_view text) {
    const LibraryLock lock;
    const std::string padded = text.empty() ? std::string(1, '\0') : std::string(text);
    const Handle type = text_type(padded.size()), creation = chunked({1}, Packing::plain);
    const Handle dataset =
        impl_->make_dataset(name, type.get(), simple_space({1}).get(), creation.get(), H5P_DEFAULT);
    impl_->check(H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, padded.data()) >= 0,
                 name);
}

void Writer::write_virtual(const std::string& name, Type type, const Shape& shape,
                           const VirtualSource& source) {
    const LibraryLock lock;
    const Handle creation = without_times(H5P_DATASET_CREATE), space = simple_space(shape);
    impl_->check(H5Pset_virtual(creation.get(), space.get(), source.file.c_str(), source.dataset.c_str(),
                                space.get()) >= 0,
                 name);
    impl_->make_dataset(name, file_type(type), space.get(), creation.get(), H5P_DEFAULT);
}

void Writer::link(const std::string& name, const std::string& target) {
    const LibraryLock lock;
    impl_->make_parent(name);
    const bool made =
        H5Lcreate_soft(target.c_str(), impl_->file.get(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT) >= 0;
    impl_->check(made, name);
}

void Writer::attribute(const std::string& object, const std::string& name, std::string_view value) {
    if (value.size() > longest_attribute)
        throw std::runtime_error(fmt::format("{}: attribute '{}' has {} bytes; allowed: at most {}",
                                             path().string(), name, value.size(), longest_attribute));
    const LibraryLock lock;
    const std::string padded = value.empty() ? std::string(1, '\0') : std::string(value);
    const Handle type = text_type(padded.size());
    impl_->add_attribute(object, name, type.get(), type.get(), padded.data());
}

void Writer::number_attribute(const std::string& object, const std::string& name, Type type,
                              const void* value) {
    const LibraryLock lock;
    impl_->add_attribute(object, name, file_type(type), memory_type(type), value);
}

int Writer::begin_growing(const std::string& name, Type type, const Shape& row, std::size_t rows_per_chunk,
                          Packing packing) {
    const LibraryLock lock;
    Shape chunk = row;
    chunk.insert(chunk.begin(), rows_per_chunk);
    auto size = dimensions(chunk), limit = size;
    size[0] = 0;
    limit[0] = H5S_UNLIMITED;
    const Handle space(H5Screate_simple(size.size(), size.data(), limit.data()));
    const Handle creation = chunked(chunk, packing), access(H5Pcreate(H5P_DATASET_ACCESS));
    // The cache must hold the chunk being filled; otherwise each row goes to disk and back.
    H5Pset_chunk_cache(access.get(), 11, element_count(chunk) * size_of(type), 1.0);
    Handle dataset = impl_->make_dataset(name, file_type(type), space.get(), creation.get(), access.get());
    impl_->growing.emplace(impl_->next_handle, Growing{name, type, row, 0, std::move(dataset)});
    return impl_->next_handle++;
}

void Writer::append_values(int handle, Type type, const void* values, std::size_t count) {
    const LibraryLock lock;
    Growing& g = impl_->at(handle);
    const std::size_t per_row = element_count(g.row);
    if (type != g.type || per_row == 0 || count % per_row != 0)
        throw std::logic_error(fmt::format("'{}' has rows of {} {}; got {} {}", g.name, per_row,
                                           h5::name(g.type), count, h5::name(type)));
    Shape shape = g.row;
    shape.insert(shape.begin(), count / per_row);
    auto start = dimensions(shape), extent = start;
    const auto size = start;
    std::ranges::fill(start, 0);
    start[0] = g.rows;
    extent[0] = g.rows + size[0];
    impl_->check(H5Dset_extent(g.dataset.get(), extent.data()) >= 0, g.name);
    const Handle target(H5Dget_space(g.dataset.get())), source = simple_space(shape);
    const bool written =
        H5Sselect_hyperslab(target.get(), H5S_SELECT_SET, start.data(), nullptr, size.data(), nullptr) >= 0 &&
        H5Dwrite(g.dataset.get(), memory_type(type), source.get(), target.get(), H5P_DEFAULT, values) >= 0;
    impl_->check(written, g.name);
    g.rows += size[0];
}

void Writer::end_growing(int handle) {
    const LibraryLock lock;
    const std::string name = impl_->at(handle).name;
    const bool closed = H5Dclose(impl_->at(handle).dataset.release()) >= 0;
    impl_->growing.erase(handle);
    impl_->check(closed, name);
}

void Writer::commit() {
    {
        const LibraryLock lock;
        impl_->growing.clear();
        const bool closed = H5Fclose(impl_->file.release()) >= 0;
        impl_->check(closed, "/");
    }
    impl_->temporary.commit();
}

}  // namespace nbd::h5
