#include "meshing/h5/reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <climits>

#include "meshing/h5/reader_impl.hpp"
#include "meshing/h5/version.hpp"

namespace nbd::h5 {

namespace {

// HDF5 1.10 sorts names through a table; if a damaged block ends the listing early, it frees table entries
// that it never filled. The native order uses no table.
constexpr H5_iter_order_t any_order = H5_ITER_NATIVE;

/// Sorted names of what `iterate(callback, list)` goes through. item: for errors.
template <class Iterate>
std::vector<std::string> names_from(const Reader::Impl& file, const std::string& item,
                                    const Iterate& iterate) {
    std::vector<std::string> names;
    const auto keep = [](hid_t, const char* name, const auto*, void* list) -> herr_t {
        static_cast<std::vector<std::string>*>(list)->emplace_back(name);
        return 0;
    };
    if (iterate(keep, &names) < 0) file.refuse_damaged(item);
    std::ranges::sort(names);
    return names;
}

Shape shape_of(hid_t dataset) {
    const Handle space(H5Dget_space(dataset));
    std::vector<hsize_t> d(std::max(0, H5Sget_simple_extent_ndims(space.get())));
    H5Sget_simple_extent_dims(space.get(), d.data(), nullptr);
    return {d.begin(), d.end()};
}

bool is_virtual(hid_t dataset) {
    const Handle creation(H5Dget_create_plist(dataset));
    return H5Pget_layout(creation.get()) == H5D_VIRTUAL;
}

void refuse_virtual(const Reader& file, const std::string& dataset, const Handle& opened) {
    if (is_virtual(opened.get()))
        file.refuse(fmt::format("virtual dataset '{}' stores its numbers in another file", dataset),
                    "reading that file instead");
}

bool fits(const Shape& shape, const Shape& expected) {
    return std::ranges::equal(
        shape, expected, [](std::size_t has, std::size_t wanted) { return wanted == any || has == wanted; });
}

/// Whether so many stored bytes can hold this shape. Deflate packs at most 1032 to 1, so a larger claim is
/// false; without this check it would be allocated before the error shows.
bool is_credible(const Shape& shape, std::size_t element_size, std::size_t stored_bytes) {
    double bytes = element_size;
    for (const std::size_t d : shape) {
        if (d > INT_MAX) return false;
        bytes *= d;
    }
    return bytes <= 1100. * static_cast<double>(stored_bytes);
}

}  // namespace

bool stays_in_folder(const std::filesystem::path& path) {
    const std::filesystem::path place = path.lexically_normal();
    return !place.empty() && !place.is_absolute() && *place.begin() != "..";
}

Reader::Reader(const std::filesystem::path& path) : impl_(std::make_unique<Impl>(path)) {}

Reader::Reader(const std::filesystem::path& path, const Format& expected) : Reader(path) {
    const Format& has = format();
    if (has.name != expected.name)
        refuse(fmt::format("is a file of format '{}'", has.name), fmt::format("'{}'", expected.name));
    if (has.version > expected.version)
        refuse(fmt::format("is a file of '{}' version {} from nbdtree {}", has.name, has.version,
                           attribute<std::string>("/", "program_version")),
               fmt::format("versions up to {}, read by nbdtree {}", expected.version, version()));
}

Reader::~Reader() = default;
Reader::Reader(Reader&&) noexcept = default;

const std::filesystem::path& Reader::path() const noexcept { return impl_->path; }
const Format& Reader::format() const noexcept { return impl_->format; }
void Reader::refuse(const std::string& what, const std::string& allowed) const {
    impl_->refuse(what, allowed);
}

bool Reader::has(const std::string& name) const { return impl_->has(name); }

bool Reader::is_group(const std::string& name) const {
    const LibraryLock lock;
    return H5Iget_type(impl_->open_object(name).get()) == H5I_GROUP;
}

bool Reader::is_text(const std::string& dataset) const {
    const LibraryLock lock;
    const Handle opened = impl_->open_dataset(dataset), type(H5Dget_type(opened.get()));
    return H5Tget_class(type.get()) == H5T_STRING;
}

std::string Reader::link_target(const std::string& name) const {
    const LibraryLock lock;
    if (!has(name)) refuse(fmt::format("has no '{}'", name), "a file with this item");
    H5L_info_t info{};
    if (H5Lget_info(impl_->file.get(), name.c_str(), &info, H5P_DEFAULT) < 0)
        impl_->refuse_damaged(fmt::format("'{}'", name));
    if (info.type != H5L_TYPE_SOFT) return "";
    std::string target(info.u.val_size, '\0');
    if (H5Lget_val(impl_->file.get(), name.c_str(), target.data(), target.size(), H5P_DEFAULT) < 0)
        impl_->refuse_damaged(fmt::format("'{}'", name));
    return target.c_str();
}

std::vector<std::string> Reader::children(const std::string& group) const {
    const LibraryLock lock;
    if (!has(group)) refuse(fmt::format("has no '{}'", group), "a file with this item");
    return names_from(*impl_, fmt::format("group '{}'", group), [&](auto keep, void* names) {
        return H5Literate_by_name(impl_->file.get(), group.c_str(), H5_INDEX_NAME, any_order, nullptr, keep,
                                  names, H5P_DEFAULT);
    });
}

std::optional<VirtualSource> Reader::virtual_source(const std::string& dataset) const {
    const LibraryLock lock;
    const Handle opened = impl_->open_dataset(dataset), creation(H5Dget_create_plist(opened.get()));
    if (!is_virtual(opened.get())) return {};
    std::size_t count = 0;
    H5Pget_virtual_count(creation.get(), &count);
    if (count != 1)
        refuse(fmt::format("virtual dataset '{}' has {} sources", dataset, count),
               "one source, as written by nbdtree");
    const auto text = [&](auto get) {
        const ssize_t length = get(creation.get(), 0, nullptr, 0);
        if (length < 0) impl_->refuse_damaged(fmt::format("virtual dataset '{}'", dataset));
        std::string value(length, '\0');
        get(creation.get(), 0, value.data(), value.size() + 1);
        return value;
    };
    VirtualSource source{text(H5Pget_virtual_filename), text(H5Pget_virtual_dsetname)};
    if (!stays_in_folder(source.file))
        refuse(fmt::format("virtual dataset '{}' reads '{}', outside of the folder of the file", dataset,
                           source.file),
               "sources in that folder or below");
    return source;
}

Shape Reader::shape(const std::string& dataset) const {
    const LibraryLock lock;
    return shape_of(impl_->open_dataset(dataset).get());
}

Type Reader::type(const std::string& dataset) const {
    const LibraryLock lock;
    const Handle opened = impl_->open_dataset(dataset), stored(H5Dget_type(opened.get()));
    constexpr Type types[] = {Type::float32, Type::float64, Type::int32, Type::int64, Type::uint64};
    const auto found =
        std::ranges::find_if(types, [&](Type t) { return H5Tequal(stored.get(), file_type(t)) > 0; });
    if (found == std::end(types))
        refuse(fmt::format("dataset '{}' has a number type that nbdtree files do not use", dataset),
               "float32, float64, int32, int64, uint64, little-endian");
    return *found;
}

Shape Reader::check(const std::string& dataset, Type type, const Shape& expected) const {
    const LibraryLock lock;
    if (const Type has = this->type(dataset); has != type)
        refuse(fmt::format("dataset '{}' holds {}", dataset, h5::name(has)), std::string(h5::name(type)));
    const Shape shape = this->shape(dataset);
    if (!fits(shape, expected))
        refuse(fmt::format("dataset '{}' is {}", dataset, text(shape)), text(expected));
    const Handle opened = impl_->open_dataset(dataset);
    const std::size_t stored = std::min<std::size_t>(H5Dget_storage_size(opened.get()), impl_->bytes);
    impl_->check_reads();
    if (!is_virtual(opened.get()) && !is_credible(shape, size_of(type), stored))
        refuse(fmt::format("dataset '{}' is {}", dataset, text(shape)), "a size that the file can hold");
    return shape;
}

void Reader::read_values(const std::string& dataset, Type type, void* values) const {
    const LibraryLock lock;
    const Handle opened = impl_->open_dataset(dataset);
    refuse_virtual(*this, dataset, opened);
    if (element_count(shape_of(opened.get())) == 0) return;
    if (H5Dread(opened.get(), memory_type(type), H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0)
        impl_->refuse_damaged(fmt::format("dataset '{}'", dataset));
}

void Reader::read_rows(const std::string& dataset, Type type, std::size_t begin, std::size_t count,
                       void* values) const {
    const LibraryLock lock;
    if (impl_->kept_name != dataset) {
        impl_->kept_name.clear();
        impl_->kept = impl_->open_dataset(dataset);
        refuse_virtual(*this, dataset, impl_->kept);
        impl_->kept_name = dataset;
    }
    if (count == 0) return;
    const Shape shape = shape_of(impl_->kept.get());
    std::vector<hsize_t> start(shape.size(), 0), size(shape.begin(), shape.end());
    start[0] = begin;
    size[0] = count;
    const Handle source(H5Dget_space(impl_->kept.get())),
        target(H5Screate_simple(size.size(), size.data(), nullptr));
    if (H5Sselect_hyperslab(source.get(), H5S_SELECT_SET, start.data(), nullptr, size.data(), nullptr) < 0 ||
        H5Dread(impl_->kept.get(), memory_type(type), target.get(), source.get(), H5P_DEFAULT, values) < 0)
        impl_->refuse_damaged(fmt::format("dataset '{}'", dataset));
}

std::string Reader::read_text(const std::string& dataset) const { return impl_->text_dataset(dataset); }
std::string Reader::text_attribute(const std::string& object, const std::string& name) const {
    return impl_->text_attribute(object, name);
}
void Reader::number_attribute(const std::string& object, const std::string& name, Type type,
                              void* value) const {
    impl_->number_attribute(object, name, type, value);
}

bool Reader::has_attribute(const std::string& object, const std::string& name) const {
    const LibraryLock lock;
    const htri_t there = H5Aexists_by_name(impl_->file.get(), object.c_str(), name.c_str(), H5P_DEFAULT);
    if (there < 0) impl_->refuse_damaged(fmt::format("'{}'", object));
    return there > 0;
}

std::vector<std::string> Reader::attributes(const std::string& object) const {
    const LibraryLock lock;
    return names_from(*impl_, fmt::format("'{}'", object), [&](auto keep, void* names) {
        return H5Aiterate_by_name(impl_->file.get(), object.c_str(), H5_INDEX_NAME, any_order, nullptr, keep,
                                  names, H5P_DEFAULT);
    });
}

std::string Reader::attribute_text(const std::string& object, const std::string& name) const {
    const LibraryLock lock;
    const Handle opened = impl_->open_attribute(object, name), type(H5Aget_type(opened.get()));
    switch (H5Tget_class(type.get())) {
        case H5T_STRING:
            return attribute<std::string>(object, name);
        case H5T_FLOAT:
            return fmt::to_string(attribute<double>(object, name));
        default:
            return H5Tget_sign(type.get()) == H5T_SGN_NONE
                       ? fmt::to_string(attribute<std::uint64_t>(object, name))
                       : fmt::to_string(attribute<std::int64_t>(object, name));
    }
}

}  // namespace nbd::h5
