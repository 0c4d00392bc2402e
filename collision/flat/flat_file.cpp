#include "collision/flat/flat_file.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "collision/base/message.hpp"
#include "collision/flat/crc64.hpp"

namespace nbd {
namespace {

constexpr std::size_t alignment = 64;
constexpr std::string_view number_types[] = {"|u1", "<i4", "<i8", "<f4", "<f8"};

constexpr std::size_t aligned(std::size_t offset) noexcept {
    return (offset + alignment - 1) / alignment * alignment;
}

std::size_t number_bytes(std::string_view type) noexcept { return type[2] - '0'; }

std::uint64_t checksum(std::span<const std::byte> file) noexcept {
    constexpr std::size_t at = offsetof(FlatHeader, checksum), after = at + sizeof(FlatHeader::checksum);
    return crc64(file.subspan(after), crc64(file.first(at)));
}

[[noreturn]] void fail(const auto&... parts) { throw std::runtime_error(message(parts...)); }

/// Text of a field that is padded with zeros; empty if there is no final zero.
template <std::size_t n>
std::string_view text(const char (&field)[n]) noexcept {
    const char* end = std::find(field, field + n, '\0');
    return {field, end == field + n ? 0 : static_cast<std::size_t>(end - field)};
}

FlatHeader checked_header(std::span<const std::byte> file) {
    FlatHeader header;
    if (!is_flat_file(file)) fail("is not a flat tree; allowed: files from `nbdtree export --flat`");
    if (file.size() < sizeof header) fail("has ", file.size(), " bytes; allowed: at least ", sizeof header);
    std::memcpy(&header, file.data(), sizeof header);
    if (header.byte_order != FlatHeader::known_byte_order)
        fail("has its numbers in another byte order; allowed: little-endian");
    if (header.version < FlatHeader::oldest_version || header.version > FlatHeader::known_version)
        fail("is a flat tree of version ", header.version, "; allowed: ", FlatHeader::oldest_version, " to ",
             FlatHeader::known_version,
             header.version < FlatHeader::oldest_version ? "; write it again with `nbdtree export --flat`"
                                                         : "");
    if (header.bytes != file.size())
        fail("has ", file.size(), " bytes; allowed: ", header.bytes, ", according to its header");
    if (const std::uint64_t is = checksum(file); is != header.checksum)
        fail("is damaged: its checksum is ", is, "; allowed: ", header.checksum, ", according to its header");
    if (header.arrays > (file.size() - sizeof header) / sizeof(FlatEntry))
        fail("lists ", header.arrays, " arrays; allowed: as many as fit the size of the file");
    return header;
}

FlatArray checked_array(const FlatEntry& entry, std::span<const std::byte> file) {
    const std::string_view name = text(entry.name), type = text(entry.type);
    const auto known = std::ranges::find(number_types, type);
    if (name.empty() || known == std::end(number_types))
        fail("lists an array without a name or with an unknown type");
    const std::size_t room =
        entry.offset <= file.size() ? (file.size() - entry.offset) / number_bytes(type) : 0;
    constexpr std::uint64_t most = std::numeric_limits<std::int32_t>::max();
    if (entry.offset % alignment != 0 || entry.rows > most || entry.columns > most ||
        entry.rows * entry.columns > room)
        fail(name, " has ", entry.rows, " x ", entry.columns, " numbers from byte ", entry.offset,
             "; allowed: within the file's ", file.size(), " bytes, starting at a multiple of ", alignment);
    return {std::string(name), *known, entry.rows, entry.columns,
            file.subspan(std::min<std::size_t>(entry.offset, file.size()),
                         entry.rows * entry.columns * number_bytes(type))};
}

}  // namespace

void FlatWriter::add(std::string_view name, std::string_view type, std::size_t rows, std::size_t columns,
                     std::span<const std::byte> values) {
    FlatEntry entry{.offset = values_.size(), .rows = rows, .columns = columns};
    if (name.size() >= sizeof entry.name)
        throw std::length_error(message("\"", name, "\" is too long for an array name, allowed: 63 bytes"));
    std::ranges::copy(name, entry.name);
    std::ranges::copy(type, entry.type);
    entries_.push_back(entry);
    values_.insert(values_.end(), values.begin(), values.end());
    values_.resize(aligned(values_.size()));
}

std::vector<std::byte> FlatWriter::finish() const {
    const std::size_t table = entries_.size() * sizeof(FlatEntry),
                      first = aligned(sizeof(FlatHeader) + table);
    std::vector<std::byte> file(first);
    std::vector<FlatEntry> entries = entries_;
    for (FlatEntry& entry : entries) entry.offset += first;
    if (table > 0) std::memcpy(file.data() + sizeof(FlatHeader), entries.data(), table);
    file.insert(file.end(), values_.begin(), values_.end());
    FlatHeader header{.bytes = file.size(), .arrays = entries.size()};
    std::ranges::copy(FlatHeader::known_magic, header.magic);
    std::memcpy(file.data(), &header, sizeof header);
    header.checksum = checksum(file);
    std::memcpy(file.data(), &header, sizeof header);
    return file;
}

bool is_flat_file(std::span<const std::byte> beginning) noexcept {
    const auto magic = std::as_bytes(std::span(FlatHeader::known_magic));
    return beginning.size() >= magic.size() && std::ranges::equal(beginning.first(magic.size()), magic);
}

FlatReader::FlatReader(std::span<const std::byte> file) {
    const FlatHeader header = checked_header(file);
    for (std::size_t i = 0; i < header.arrays; ++i) {
        FlatEntry entry;
        std::memcpy(&entry, file.data() + sizeof header + i * sizeof entry, sizeof entry);
        arrays_.push_back(checked_array(entry, file));
    }
    std::vector<std::string_view> names;
    for (const FlatArray& array : arrays_) names.push_back(array.name);
    std::ranges::sort(names);
    if (const auto twice = std::ranges::adjacent_find(names); twice != names.end())
        fail("lists ", *twice, " twice");
}

bool FlatReader::has(std::string_view prefix) const noexcept {
    return std::ranges::any_of(arrays_, [&](const FlatArray& a) { return a.name.starts_with(prefix); });
}

const FlatArray& FlatReader::array(std::string_view name) const {
    const auto found = std::ranges::find(arrays_, name, &FlatArray::name);
    if (found == arrays_.end())
        fail("has no array ", name, "; allowed: flat trees with all arrays of their version");
    return *found;
}

void FlatReader::refuse(std::string_view name, std::string_view what, std::string_view allowed) {
    fail(name, " is ", what, "; allowed: ", allowed);
}

}  // namespace nbd
