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

// A file of named arrays that can be mapped into memory and used where it lies: format, version, byte order
// and a checksum in front, then a table, then the numbers. Little-endian throughout:
//
//     FlatHeader   64 bytes
//     FlatEntry    96 bytes an array
//     arrays       each row-major, from an offset that is a multiple of 64; zeros in between
namespace nbd {

static_assert(std::endian::native == std::endian::little, "flat files hold numbers as this machine does");

struct FlatHeader {
    static constexpr std::string_view known_magic{"nbdflat\n"};
    static constexpr std::uint32_t known_byte_order = 0x01020304, oldest_version = 2, known_version = 3;

    char magic[8]{};
    std::uint32_t byte_order = known_byte_order;
    std::uint32_t version = known_version;
    std::uint64_t bytes = 0;     // of the whole file
    std::uint64_t checksum = 0;  // crc64() of the whole file but for these 8 bytes
    std::uint64_t arrays = 0;    // entries of the table
    std::uint64_t unused[3]{};   // 0
};
static_assert(sizeof(FlatHeader) == 64);

struct FlatEntry {
    char name[64]{};  // "learned/samples", filled up with zeros
    char type[8]{};   // as NumPy names it: "|u1", "<i4", "<i8", "<f4", "<f8", filled up with zeros
    std::uint64_t offset = 0;
    std::uint64_t rows = 0, columns = 0;
};
static_assert(sizeof(FlatEntry) == 96);

/// FlatEntry::type of a number.
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

/// Collects arrays.
class FlatWriter {
 public:
    /// values: row-major, copied. Throws std::length_error on a name of more than 63 bytes.
    template <FlatNumber T>
    void add(std::string_view name, std::size_t rows, std::size_t columns, const T* values) {
        add(name, flat_type<T>(), rows, columns, std::as_bytes(std::span(values, rows * columns)));
    }

    /// The file.
    std::vector<std::byte> finish() const;

 private:
    void add(std::string_view name, std::string_view type, std::size_t rows, std::size_t columns,
             std::span<const std::byte> values);

    std::vector<FlatEntry> entries_;  // offsets from the end of the table
    std::vector<std::byte> values_;
};

/// Whether a file that begins so is meant to be a flat one.
bool is_flat_file(std::span<const std::byte> beginning) noexcept;

/// What stands in a file's table.
struct FlatArray {
    std::string name;
    std::string_view type;              // NumPy's, one that flat_type() gives
    std::size_t rows = 0, columns = 0;  // none above 2^31 - 1
    std::span<const std::byte> values;
};

/// Checks a file and finds its arrays. Errors are std::runtime_error: what is wrong; what was allowed.
class FlatReader {
 public:
    /// file: referred to; any alignment. Throws where it is no such file, truncated, longer than it says,
    /// damaged, of another version or byte order, or where its table is out of order.
    explicit FlatReader(std::span<const std::byte> file);

    const std::vector<FlatArray>& arrays() const noexcept { return arrays_; }

    /// Of the file's format, at most FlatHeader::known_version.
    int version() const noexcept { return version_; }

    /// Calls arrays whose name begins with `stored`, as an older version has it, by the name of today.
    void rename(std::string_view stored, std::string_view name);

    /// Whether there is an array whose name begins so.
    bool has(std::string_view prefix) const noexcept;

    /// The array of a name. Throws where it is missing.
    const FlatArray& array(std::string_view name) const;

    /// Throws "NAME is WHAT; allowed: ALLOWED".
    [[noreturn]] static void refuse(std::string_view name, std::string_view what, std::string_view allowed);

 private:
    std::vector<FlatArray> arrays_;
    int version_ = 0;
};

}  // namespace nbd
