#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "meshing/formats/base64.hpp"
#include "meshing/formats/tet_formats.hpp"
#include "meshing/formats/words.hpp"
#include "meshing/formats/xml_tags.hpp"

namespace nbd {
namespace {

constexpr std::string_view vtu_white = " \t\r\n\v\f";

/// Where the numbers of an array are.
struct DataArray {
    XmlTag tag;
    std::string_view content;  // between its tags
};

struct Piece {
    std::size_t tag = 0;  // where it begins
    std::size_t points = 0, cells = 0;
    std::optional<DataArray> positions{}, connectivity{}, offsets{}, types{}, groups{};
};

enum class Kind { integer, unsigned_integer, real };

struct NumberType {
    std::string_view name;
    std::size_t bytes;
    Kind kind;
};

constexpr NumberType number_types[] = {{"Int8", 1, Kind::integer},  {"UInt8", 1, Kind::unsigned_integer},
                                       {"Int16", 2, Kind::integer}, {"UInt16", 2, Kind::unsigned_integer},
                                       {"Int32", 4, Kind::integer}, {"UInt32", 4, Kind::unsigned_integer},
                                       {"Int64", 8, Kind::integer}, {"UInt64", 8, Kind::unsigned_integer},
                                       {"Float32", 4, Kind::real},  {"Float64", 8, Kind::real}};

class VtuReader {
 public:
    explicit VtuReader(FileCursor& in) : in_(in), text_(in.bytes()) {}

    TetFileContent read() {
        find_parts();
        for (const Piece& piece : pieces_) read_piece(piece);
        return std::move(content_);
    }

 private:
    [[noreturn]] void fail(std::size_t at, const std::string& what) const {
        in_.move_to(at);
        in_.fail(what);
    }

    std::string_view attribute(const XmlTag& tag, std::string_view key,
                               std::string_view fallback = {}) const {
        const auto found = tag.attributes.find(key);
        if (found != tag.attributes.end()) return found->second;
        if (fallback.data()) return fallback;
        fail(tag.begin, fmt::format("<{}> has no attribute {}", printable(tag.name), key));
    }

    std::size_t count(const XmlTag& tag, std::string_view key) const {
        std::string_view text = attribute(tag, key);
        text.remove_prefix(std::min(text.find_first_not_of(vtu_white), text.size()));
        text = text.substr(0, text.find_first_of(vtu_white));
        constexpr std::size_t most = std::numeric_limits<int>::max();
        const auto value = number_in<std::size_t>(text);
        if (!value || *value > most)
            fail(tag.begin,
                 fmt::format("{} is '{}'; allowed: a whole number up to {}", key, printable(text), most));
        return *value;
    }

    void read_head(const XmlTag& tag) {
        if (const std::string_view type = attribute(tag, "type"); type != "UnstructuredGrid")
            fail(tag.begin, fmt::format("holds {}; allowed: UnstructuredGrid", printable(type)));
        const std::string_view order = attribute(tag, "byte_order", "LittleEndian"),
                               header = attribute(tag, "header_type", "UInt32"),
                               compressor = attribute(tag, "compressor", "");
        if (order != "LittleEndian" && order != "BigEndian")
            fail(tag.begin,
                 fmt::format("byte_order is {}; allowed: LittleEndian, BigEndian", printable(order)));
        is_swapped_ = (order == "BigEndian") != (std::endian::native == std::endian::big);
        if (header != "UInt32" && header != "UInt64")
            fail(tag.begin, fmt::format("header_type is {}; allowed: UInt32, UInt64", printable(header)));
        header_bytes_ = header == "UInt32" ? 4 : 8;
        is_packed_ = !compressor.empty();
        if (is_packed_ && compressor != "vtkZLibDataCompressor")
            fail(tag.begin, fmt::format("compressor is {}; allowed: vtkZLibDataCompressor, or none",
                                        printable(compressor)));
    }

    /// Finds the arrays that are read, up to the appended data, in which no tags may be looked for.
    void find_parts() {
        XmlTag tag;
        std::size_t at = 0;
        std::string_view section;
        bool has_head = false, has_end = false;
        while (!has_end && next_tag(text_, at, tag)) {
            at = tag.end;
            if (!has_head && tag.name != "VTKFile")
                fail(tag.begin, "not a VTK file: it does not begin with <VTKFile>");
            if (tag.name == "VTKFile") {
                if (tag.closes) {
                    has_end = true;
                } else if (std::exchange(has_head, true)) {
                    fail(tag.begin, "a second <VTKFile>");
                } else {
                    read_head(tag);
                }
            } else if (tag.name == "AppendedData") {
                find_appended(tag);
                has_end = true;
            } else if (tag.name == "Piece" && !tag.closes) {
                pieces_.push_back({tag.begin, count(tag, "NumberOfPoints"), count(tag, "NumberOfCells")});
            } else if (tag.name == "Points" || tag.name == "Cells" || tag.name == "CellData") {
                section = tag.closes || tag.is_empty ? std::string_view{} : tag.name;
            } else if (tag.name == "DataArray" && !tag.closes && !section.empty() && !pieces_.empty()) {
                add_array(section, tag);
            }
        }
        if (!has_head) fail(0, "not a VTK file: it does not begin with <VTKFile>");
        if (!has_end) fail(text_.size(), "the file ends early, without </VTKFile>");
    }

    void add_array(std::string_view section, const XmlTag& tag) {
        DataArray array{tag, {}};
        if (!tag.is_empty) array.content = text_.substr(tag.end, text_.find('<', tag.end) - tag.end);
        Piece& piece = pieces_.back();
        if (section == "Points") {
            if (!piece.positions) piece.positions = array;
            return;
        }
        const std::string_view name = attribute(tag, "Name", "");
        if (section == "CellData") {
            const auto type = std::ranges::find(number_types, attribute(tag, "type"), &NumberType::name);
            if (!piece.groups && names_groups(name) && type != std::end(number_types) &&
                type->kind != Kind::real && attribute(tag, "NumberOfComponents", "1") == "1")
                piece.groups = array;
            return;
        }
        if (name == "connectivity") piece.connectivity = array;
        if (name == "offsets") piece.offsets = array;
        if (name == "types") piece.types = array;
    }

    void find_appended(const XmlTag& tag) {
        const std::string_view encoding = attribute(tag, "encoding");
        if (encoding != "raw" && encoding != "base64")
            fail(tag.begin, fmt::format("encoding is {}; allowed: raw, base64", printable(encoding)));
        const std::size_t begin = text_.find('_', tag.end);
        if (begin == text_.npos) fail(tag.begin, "the appended data do not begin with _");
        appended_ = text_.substr(begin + 1);
        appended_is_raw_ = encoding == "raw";
        if (!appended_is_raw_) appended_ = appended_.substr(0, appended_.find('<'));
    }

    std::uint64_t header_at(std::string_view bytes, std::size_t at, const XmlTag& tag) const {
        if (bytes.size() < at + header_bytes_)
            fail(tag.begin, "the file ends early, in the length of an array");
        return unsigned_at(bytes.data() + at, header_bytes_);
    }

    std::uint64_t unsigned_at(const char* bytes, std::size_t size) const {
        std::uint64_t value = 0;
        for (std::size_t k = 0; k < size; ++k) {
            const bool low_first = (std::endian::native == std::endian::little) != is_swapped_;
            const auto byte = static_cast<unsigned char>(bytes[low_first ? size - 1 - k : k]);
            value = value << 8 | byte;
        }
        return value;
    }

    /// The bytes of an array as they are in the file: with the lengths, and packed if they are.
    std::string stored(const DataArray& array) const {
        const XmlTag& tag = array.tag;
        const std::string_view format = attribute(tag, "format", "ascii");
        std::string_view text = array.content;
        if (format == "appended") {
            const std::size_t offset = count(tag, "offset");
            if (offset > appended_.size())
                fail(tag.begin,
                     fmt::format("its data begin at {}, but {} were appended", offset, appended_.size()));
            text = appended_.substr(offset);
            if (appended_is_raw_) return std::string(text.substr(0, raw_size(text, tag)));
            text = text.substr(0, text_end(text));
        } else if (format != "binary") {
            fail(tag.begin, fmt::format("format is {}; allowed: ascii, binary, appended", printable(format)));
        }
        auto bytes = from_base64(text);
        if (!bytes) fail(tag.begin, "its data are not in base 64");
        return std::move(*bytes);
    }

    /// The raw appended bytes that belong to an array.
    std::size_t raw_size(std::string_view bytes, const XmlTag& tag) const {
        const std::uint64_t first = header_at(bytes, 0, tag);
        if (!is_packed_)
            return static_cast<std::size_t>(std::min<std::uint64_t>(first, bytes.size() - header_bytes_)) +
                   header_bytes_;
        if (first > bytes.size() / header_bytes_)
            fail(tag.begin, "the file ends early, in the lengths of blocks");
        const std::size_t head = (3 + static_cast<std::size_t>(first)) * header_bytes_;
        std::uint64_t size = head;
        for (std::size_t block = 0; block < first; ++block) {
            const std::uint64_t length = header_at(bytes, (3 + block) * header_bytes_, tag);
            size += std::min<std::uint64_t>(length, bytes.size());
        }
        return std::min<std::uint64_t>(size, bytes.size());
    }

    /// How much of the appended text in base 64 belongs to the array at its beginning.
    std::size_t text_end(std::string_view text) const {
        // Padding ends a block of bytes, but the next one may belong to the same array: decodes the lengths.
        const std::size_t head_text = (header_bytes_ * (is_packed_ ? 3 : 1) + 2) / 3 * 4;
        const auto head = from_base64(text.substr(0, head_text));
        if (!head || head->size() < header_bytes_) return text.size();
        if (!is_packed_) {
            const std::uint64_t length = unsigned_at(head->data(), header_bytes_);
            const std::uint64_t characters =
                (std::min<std::uint64_t>(length, text.size()) + header_bytes_ + 2) / 3 * 4;
            return std::min<std::uint64_t>(characters, text.size());
        }
        const std::uint64_t blocks = unsigned_at(head->data(), header_bytes_);
        if (blocks > text.size()) return text.size();
        const std::uint64_t lengths_text = ((3 + blocks) * header_bytes_ + 2) / 3 * 4;
        if (lengths_text > text.size()) return text.size();
        const auto lengths = from_base64(text.substr(0, lengths_text));
        if (!lengths || lengths->size() < (3 + blocks) * header_bytes_) return text.size();
        // Blocks are encoded together or one by one; what lies behind the last one is not looked at.
        std::uint64_t characters = lengths_text;
        for (std::size_t block = 0; block < blocks; ++block) {
            const std::uint64_t length =
                unsigned_at(lengths->data() + (3 + block) * header_bytes_, header_bytes_);
            characters += (std::min<std::uint64_t>(length, text.size()) + 2) / 3 * 4;
        }
        return std::min<std::uint64_t>(characters, text.size());
    }

    /// The bytes of the numbers, `wanted` of them.
    std::string unpacked(const std::string& bytes, std::uint64_t wanted, const XmlTag& tag) const {
        const auto check_length = [&](std::uint64_t length) {
            if (length != wanted)
                fail(tag.begin, fmt::format("the array has {} bytes; allowed: {}", length, wanted));
        };
        if (!is_packed_) {
            const std::uint64_t length = header_at(bytes, 0, tag);
            check_length(length);
            if (length > bytes.size() - header_bytes_) fail(tag.begin, "the file ends early, in an array");
            return bytes.substr(header_bytes_, length);
        }
        const std::uint64_t blocks = header_at(bytes, 0, tag);
        if (blocks == 0) {
            check_length(0);
            return {};
        }
        const std::uint64_t block_size = header_at(bytes, header_bytes_, tag),
                            last_size = header_at(bytes, 2 * header_bytes_, tag);
        constexpr std::uint64_t most = std::uint64_t{1} << 40;
        if (blocks > bytes.size() / header_bytes_ || block_size > most || last_size > block_size)
            fail(tag.begin,
                 fmt::format("{} blocks of {} bytes do not fit into the file", blocks, block_size));
        check_length(last_size > 0 ? (blocks - 1) * block_size + last_size : blocks * block_size);
        if (constexpr std::uint64_t best_ratio = 1040; wanted > best_ratio * (bytes.size() + 1))
            fail(tag.begin, fmt::format("{} bytes cannot hold {}", bytes.size(), wanted));
        std::string result(wanted, '\0');
        std::size_t from = (3 + static_cast<std::size_t>(blocks)) * header_bytes_, to = 0;
        for (std::size_t block = 0; block < blocks; ++block) {
            const std::uint64_t packed = header_at(bytes, (3 + block) * header_bytes_, tag);
            if (from > bytes.size() || packed > bytes.size() - from)
                fail(tag.begin, "the file ends early, in a packed array");
            const std::size_t size = block + 1 == blocks && last_size > 0 ? last_size : block_size;
            uLongf length = size;
            if (size == 0 ||
                uncompress(reinterpret_cast<Bytef*>(result.data() + to), &length,
                           reinterpret_cast<const Bytef*>(bytes.data() + from),
                           static_cast<uLong>(packed)) != Z_OK ||
                length != size)
                fail(tag.begin, fmt::format("block {} of an array cannot be unpacked", block));
            from += packed;
            to += size;
        }
        return result;
    }

    /// The numbers of an array, as reals or as integers.
    template <class T>
    std::vector<T> numbers(const std::optional<DataArray>& array, const char* what, std::size_t wanted,
                           const Piece& piece) const {
        if (!array) fail(piece.tag, fmt::format("the piece has no {}", what));
        const XmlTag& tag = array->tag;
        const std::string_view type_name = attribute(tag, "type");
        const auto type = std::ranges::find(number_types, type_name, &NumberType::name);
        if (type == std::end(number_types))
            fail(tag.begin, fmt::format("{} are of type {}; allowed: Int8 to UInt64, Float32, Float64", what,
                                        printable(type_name)));
        if (std::is_integral_v<T> && type->kind == Kind::real)
            fail(tag.begin, fmt::format("{} are of type {}; allowed: integers", what, type_name));
        if (attribute(tag, "format", "ascii") == "ascii") return text_numbers<T>(*array, what, wanted);
        const std::string bytes = unpacked(stored(*array), std::uint64_t{wanted} * type->bytes, tag);
        std::vector<T> values(wanted);
        for (std::size_t i = 0; i < wanted; ++i) {
            const std::uint64_t raw = unsigned_at(bytes.data() + i * type->bytes, type->bytes);
            const int unused = 64 - 8 * type->bytes;
            if (type->kind == Kind::real)
                values[i] = static_cast<T>(type->bytes == 4
                                               ? double{std::bit_cast<float>(static_cast<std::uint32_t>(raw))}
                                               : std::bit_cast<double>(raw));
            else
                values[i] = static_cast<T>(type->kind == Kind::integer
                                               ? static_cast<std::int64_t>(raw << unused) >> unused
                                               : static_cast<std::int64_t>(raw));
        }
        return values;
    }

    template <class T>
    std::vector<T> text_numbers(const DataArray& array, const char* what, std::size_t wanted) const {
        std::vector<T> values;
        values.reserve(std::min(wanted, array.content.size()));
        std::string_view rest = array.content;
        for (;;) {
            rest.remove_prefix(std::min(rest.find_first_not_of(vtu_white), rest.size()));
            if (rest.empty()) break;
            const std::string_view word = rest.substr(0, rest.find_first_of(vtu_white));
            rest.remove_prefix(word.size());
            const auto value = number_in<T>(word);
            if (!value || is_too_large(word, *value))
                fail(array.tag.begin, fmt::format("{} hold '{}'; allowed: numbers", what, printable(word)));
            values.push_back(*value);
        }
        if (values.size() != wanted)
            fail(array.tag.begin,
                 fmt::format("{} hold {} numbers; allowed: {}", what, values.size(), wanted));
        return values;
    }

    void read_piece(const Piece& piece) {
        if (piece.points == 0) return;
        if (piece.positions && attribute(piece.positions->tag, "NumberOfComponents", "3") != "3")
            fail(piece.positions->tag.begin, "points must have three components");
        const std::int64_t first_node = content_.nodes.size();
        const std::vector<double> x = numbers<double>(piece.positions, "points", 3 * piece.points, piece);
        content_.nodes.resize(content_.nodes.size() + piece.points);
        for (std::size_t i = 0; i < x.size(); ++i) content_.nodes[first_node + i / 3][i % 3] = x[i];
        if (piece.cells == 0) return;
        VtkCells cells;
        cells.offsets = numbers<std::int64_t>(piece.offsets, "offsets of cells", piece.cells, piece);
        cells.offsets.insert(cells.offsets.begin(), 0);
        const std::int64_t corners = cells.offsets.back();
        if (!std::ranges::is_sorted(cells.offsets) || corners > std::numeric_limits<int>::max())
            fail(piece.tag, "the offsets of cells must rise, from 0 to the number of corners");
        cells.corners = numbers<std::int64_t>(piece.connectivity, "corners of cells", corners, piece);
        cells.types = numbers<std::int64_t>(piece.types, "types of cells", piece.cells, piece);
        in_.move_to(piece.tag);
        const std::size_t first_tet = content_.tets.size();
        add_cells(cells, first_node, in_, content_);
        if (piece.groups)
            add_cell_groups(cells, numbers<std::int64_t>(piece.groups, "groups", piece.cells, piece),
                            first_node, first_tet, in_, content_);
        else if (!content_.group_of_tet.empty())
            content_.group_of_tet.resize(content_.tets.size(), 0);
    }

    FileCursor& in_;
    std::string_view text_;
    bool is_swapped_ = false, is_packed_ = false, appended_is_raw_ = false;
    std::size_t header_bytes_ = 4;
    std::string_view appended_;
    std::vector<Piece> pieces_;
    TetFileContent content_;
};

}  // namespace

TetFileContent read_vtu(FileCursor& in) { return VtuReader(in).read(); }

}  // namespace nbd
