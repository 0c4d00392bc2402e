#include "meshing/h5/content_hash.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <vector>

namespace nbd::h5 {

// Hashes memory directly: the bytes in memory must equal the bytes in the file.
static_assert(std::endian::native == std::endian::little);

namespace {

void add_line(Sha256& hash, const std::string& name, Type type, const Shape& shape) {
    const std::string line = fmt::format("{} {} {}\n", name, h5::name(type), text(shape));
    hash.add(std::as_bytes(std::span(line)));
}

template <Number T>
void add_stored(Sha256& hash, const Reader& file, const std::string& dataset, const Shape& shape) {
    constexpr std::size_t piece_bytes = 1 << 22;
    const std::size_t rows = shape[0], per_row = element_count(shape) / std::max<std::size_t>(rows, 1);
    const std::size_t step =
        std::max<std::size_t>(1, piece_bytes / (sizeof(T) * std::max<std::size_t>(1, per_row)));
    std::vector<T> values;
    for (std::size_t begin = 0; begin < rows; begin += step) {
        const std::size_t count = std::min(step, rows - begin);
        values.resize(count * per_row);
        file.read_rows(dataset, begin, count, values.data());
        hash.add(std::as_bytes(std::span(values)));
    }
}

}  // namespace

void add_dataset(Sha256& hash, const std::string& name, Type type, const Shape& shape, const void* values) {
    add_line(hash, name, type, shape);
    hash.add({static_cast<const std::byte*>(values), element_count(shape) * size_of(type)});
}

std::string content_hash(const Reader& file, std::span<const std::string> datasets) {
    Sha256 hash;
    for (const std::string& name : datasets) {
        const Type type = file.type(name);
        const Shape shape = file.check(name, type, Shape(file.shape(name).size(), any));
        if (shape.empty()) file.refuse(fmt::format("dataset '{}' is a scalar", name), "an array");
        add_line(hash, name, type, shape);
        switch (type) {
            case Type::float32:
                add_stored<float>(hash, file, name, shape);
                break;
            case Type::float64:
                add_stored<double>(hash, file, name, shape);
                break;
            case Type::int32:
                add_stored<std::int32_t>(hash, file, name, shape);
                break;
            case Type::int64:
                add_stored<std::int64_t>(hash, file, name, shape);
                break;
            case Type::uint64:
                add_stored<std::uint64_t>(hash, file, name, shape);
                break;
        }
    }
    return hash.hex();
}

}  // namespace nbd::h5
