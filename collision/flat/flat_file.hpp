#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

// A file of named arrays that can be mapped into memory and used in place: a header with format, version,
// byte order and checksum, then a table, then the numbers. Little-endian throughout:
//
//     FlatHeader   64 bytes
//     FlatEntry    96 bytes per array
//     arrays       each row-major, at an offset that is a multiple of 64; zeros in between
namespace nbd {

static_assert(std::endian::native == std::endian::little,
              "flat files are little-endian; this machine is not");

struct FlatHeader {
    static constexpr std::string_view known_magic{"nbdflat\n"};
    static constexpr std::uint32_t known_byte_order = 0x01020304, oldest_version = 3, known_version = 4;

    char magic[8]{};
    std::uint32_t byte_order = known_byte_order;
    std::uint32_t version = known_version;
    std::uint64_t bytes = 0;     // size of the whole file
    std::uint64_t checksum = 0;  // crc64() of the whole file without these 8 bytes
    std::uint64_t arrays = 0;    // number of entries in the table
    std::uint64_t unused[3]{};   // always 0
};
static_assert(sizeof(FlatHeader) == 64);

struct FlatEntry {
    char name[64]{};  // such as "learned/samples", padded with zeros
    char type[8]{};   // NumPy's name: "|u1", "<i4", "<i8", "<f4", "<f8", padded with zeros
    std::uint64_t offset = 0;
    std::uint64_t rows = 0, columns = 0;
};
static_assert(sizeof(FlatEntry) == 96);

/// FlatEntry::type of numbers of type T; empty if flat files do not hold them.
template <class T>
constexpr std::string_view flat_type() noexcept {
    if constexpr (std::same_as<T, std::uint8_t>) return "|u1";
    if constexpr (std::same_as<T, std::int32_t>) return "<i4";
    if constexpr (std::same_as<T, std::int64_t>) return "<i8";
    if constexpr (std::same_as<T, float>) return "<f4";
    if constexpr (std::same_as<T, double>) return "<f8";
}
template <class T>
concept FlatNumber = !flat_type<T>().empty();

/// Collects arrays and makes a flat file of them.
class FlatWriter {
 public:
    /// values: row-major, copied. Throws std::length_error on a name of more than 63 bytes.
    template <FlatNumber T>
    void add(std::string_view name, std::size_t rows, std::size_t columns, const T* values) {
        add(name, flat_type<T>(), rows, columns, std::as_bytes(std::span(values, rows * columns)));
    }

    /// Content of the file.
    std::vector<std::byte> finish() const;

 private:
    void add(std::string_view name, std::string_view type, std::size_t rows, std::size_t columns,
             std::span<const std::byte> values);

    std::vector<FlatEntry> entries_;  // offsets relative to the first array
    std::vector<std::byte> values_;
};

/// Whether a file with this beginning claims to be a flat file.
bool is_flat_file(std::span<const std::byte> beginning) noexcept;

/// An array of a file, as its table lists it.
struct FlatArray {
    std::string name;
    std::string_view type;              // one that flat_type() gives
    std::size_t rows = 0, columns = 0;  // at most 2^31 - 1 each
    std::span<const std::byte> values;
};

/// Checks a file and finds its arrays. Errors are std::runtime_error and say what is wrong and what was
/// allowed.
class FlatReader {
 public:
    /// file: any alignment; must outlive this object. Throws if it is not a flat file, truncated, longer than
    /// its header says, damaged, of an unknown version or another byte order, or if its table is invalid.
    explicit FlatReader(std::span<const std::byte> file);

    const std::vector<FlatArray>& arrays() const noexcept { return arrays_; }

    /// Whether the name of any array begins with `prefix`.
    bool has(std::string_view prefix) const noexcept;

    /// The array with this name. Throws if it is missing.
    const FlatArray& array(std::string_view name) const;

    /// Throws "NAME is WHAT; allowed: ALLOWED".
    [[noreturn]] static void refuse(std::string_view name, std::string_view what, std::string_view allowed);

 private:
    std::vector<FlatArray> arrays_;
};

}  // namespace nbd
