#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "meshing/formats/surface_formats.hpp"
#include "meshing/formats/words.hpp"

namespace nbd {
namespace {

enum class Encoding { ascii, little, big };

struct Type {
    int bytes = 0;
    char kind = 0;  // 'i' signed, 'u' unsigned, 'f' floating point
};

struct Property {
    std::string name;
    Type type, count_type;  // a list if count_type.bytes > 0
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
};

struct Header {
    Encoding encoding = Encoding::ascii;
    std::vector<Element> elements;
    std::size_t size = 0;  // bytes up to the data
};

[[noreturn]] void fail(const std::string& what) { throw std::runtime_error(what); }

Type parse_type(const std::string& name) {
    static const std::map<std::string, Type, std::less<>> types = {
        {"char", {1, 'i'}},  {"int8", {1, 'i'}},    {"uchar", {1, 'u'}},  {"uint8", {1, 'u'}},
        {"short", {2, 'i'}}, {"int16", {2, 'i'}},   {"ushort", {2, 'u'}}, {"uint16", {2, 'u'}},
        {"int", {4, 'i'}},   {"int32", {4, 'i'}},   {"uint", {4, 'u'}},   {"uint32", {4, 'u'}},
        {"float", {4, 'f'}}, {"float32", {4, 'f'}}, {"double", {8, 'f'}}, {"float64", {8, 'f'}}};
    const auto found = types.find(name);
    if (found == types.end()) fail(fmt::format("PLY header: unknown type \"{}\"", printable(name)));
    return found->second;
}

Encoding parse_encoding(const std::string& name) {
    if (name == "ascii") return Encoding::ascii;
    if (name == "binary_little_endian") return Encoding::little;
    if (name == "binary_big_endian") return Encoding::big;
    fail(
        fmt::format("PLY header: unknown format \"{}\"; allowed: ascii, binary_little_endian and "
                    "binary_big_endian",
                    printable(name)));
}

Property parse_property(std::istringstream& words) {
    Property property;
    std::string type;
    words >> type;
    if (type == "list") {
        std::string count_type;
        words >> count_type >> type;
        property.count_type = parse_type(count_type);
        if (property.count_type.kind == 'f') fail("PLY header: a list's count must be an integer");
    }
    property.type = parse_type(type);
    words >> property.name;
    return property;
}

Header parse_header(std::string_view data) {
    Header header;
    bool has_format = false;
    for (std::size_t line_number = 0;; ++line_number) {
        const std::size_t end = data.find('\n', header.size);
        if (end == data.npos) fail("PLY header: ends before \"end_header\"");
        std::istringstream words(std::string(data.substr(header.size, end - header.size)));
        header.size = end + 1;
        std::string word;
        words >> word;
        if (line_number == 0) {
            if (word != "ply") fail("PLY header: the file does not start with \"ply\"");
        } else if (word == "end_header") {
            break;
        } else if (word == "format") {
            words >> word;
            header.encoding = parse_encoding(word);
            has_format = true;
        } else if (word == "element") {
            Element element;
            if (!(words >> element.name >> element.count)) fail("PLY header: an element has no count");
            header.elements.push_back(std::move(element));
        } else if (word == "property") {
            if (header.elements.empty()) fail("PLY header: a property comes before the first element");
            header.elements.back().properties.push_back(parse_property(words));
        } else if (word != "comment" && word != "obj_info" && !word.empty()) {
            fail(fmt::format("PLY header: unknown keyword \"{}\"", printable(word)));
        }
    }
    if (!has_format) fail("PLY header: no \"format\" line");
    return header;
}

/// Reads the numbers of the data in sequence. next() returns false at the end of the data.
class Numbers {
 public:
    Numbers(std::string_view data, Encoding encoding) : data_(data), encoding_(encoding) {}

    bool next(Type type, double& value) {
        return encoding_ == Encoding::ascii ? next_word(value) : next_bytes(type, value);
    }

 private:
    bool next_word(double& value) {
        const std::size_t begin = data_.find_first_not_of(" \t\r\n");
        if (begin == data_.npos) return false;
        const std::size_t end = std::min(data_.find_first_of(" \t\r\n", begin), data_.size());
        const std::string_view word = data_.substr(begin, end - begin);
        const auto number = number_in<double>(word);
        if (!number) fail(fmt::format("PLY: \"{}\" is not a number", printable(word)));
        value = *number;
        data_.remove_prefix(end);
        return true;
    }

    bool next_bytes(Type type, double& value) {
        const std::size_t n = type.bytes;
        if (data_.size() < n) return false;
        char bytes[8] = {};
        const bool swap = (encoding_ == Encoding::big) != (std::endian::native == std::endian::big);
        for (std::size_t i = 0; i < n && i < sizeof bytes; ++i) bytes[i] = data_[swap ? n - 1 - i : i];
        data_.remove_prefix(n);
        if (type.kind == 'f')
            value = n == 4 ? static_cast<double>(as<float>(bytes)) : as<double>(bytes);
        else if (type.kind == 'i')
            value = n == 1   ? as<std::int8_t>(bytes)
                    : n == 2 ? as<std::int16_t>(bytes)
                             : as<std::int32_t>(bytes);
        else
            value = n == 1   ? as<std::uint8_t>(bytes)
                    : n == 2 ? as<std::uint16_t>(bytes)
                             : as<std::uint32_t>(bytes);
        return true;
    }

    template <class T>
    static T as(const char* bytes) {
        T value;
        std::memcpy(&value, bytes, sizeof value);
        return value;
    }

    std::string_view data_;
    Encoding encoding_;
};

bool is_corner_list(const Property& p) {
    return p.count_type.bytes > 0 && (p.name == "vertex_indices" || p.name == "vertex_index");
}

/// Adds the triangles of a strip: each corner makes one with the two before it, every second one turned. -1
/// ends a strip. Triangles that repeat a corner only join strips and are skipped.
class Strips {
 public:
    explicit Strips(PolygonSoup& soup) : soup_(soup) {}

    void add(std::int64_t corner) {
        if (corner == -1) return end();
        if (length_ >= 2 && corner != first_ && corner != second_ && first_ != second_) {
            const bool turned = length_ % 2 == 1;
            soup_.corners.insert(soup_.corners.end(),
                                 {turned ? second_ : first_, turned ? first_ : second_, corner});
            soup_.face_end.push_back(soup_.corners.size());
        }
        first_ = second_;
        second_ = corner;
        ++length_;
    }
    void end() { length_ = 0; }

 private:
    PolygonSoup& soup_;
    std::int64_t first_ = -1, second_ = -1;  // the last two corners
    std::size_t length_ = 0;                 // corners of the strip so far
};

void read_element(const Element& element, Numbers& numbers, PolygonSoup& soup) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face",
               is_strips = element.name == "tristrips";
    Strips strips(soup);
    const auto read = [&](Type type, std::size_t item) {
        double value = 0;
        if (!numbers.next(type, value))
            fail(fmt::format("PLY: the file ends early, in {} {} of {}", printable(element.name), item,
                             element.count));
        return value;
    };
    if (element.properties.empty()) return;  // has no data, whatever its count
    for (std::size_t i = 0; i < element.count; ++i) {
        std::array<double, 3> x{};
        for (const Property& property : element.properties) {
            const bool is_list = property.count_type.bytes > 0;
            const double count = is_list ? read(property.count_type, i) : 1;
            if (!(count >= 0) || count != std::floor(count))
                fail(fmt::format("PLY: {} {} has a list of {} entries", printable(element.name), i, count));
            const bool is_corners = (is_face || is_strips) && is_corner_list(property);
            for (double k = 0; k < count; ++k) {
                const double value = read(property.type, i);
                if (is_vertex && property.name.size() == 1 && property.name[0] >= 'x' &&
                    property.name[0] <= 'z')
                    x[property.name[0] - 'x'] = value;
                if (!is_corners) continue;
                if (!(std::abs(value) < 1e15) || value != std::floor(value))
                    fail(fmt::format("PLY: {} {} refers to vertex {}", is_face ? "face" : "strip", i, value));
                const auto corner = static_cast<std::int64_t>(value);
                if (is_face)
                    soup.corners.push_back(corner);
                else
                    strips.add(corner);
            }
            if (is_corners) strips.end();
        }
        if (is_vertex) soup.X.push_back(x);
        if (is_face) soup.face_end.push_back(soup.corners.size());
    }
}

}  // namespace

PolygonSoup read_ply(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    const std::string data{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    const Header header = parse_header(data);
    const auto has = [&](std::string_view element, auto is_wanted) {
        return std::ranges::any_of(header.elements, [&](const Element& e) {
            return e.name == element && std::ranges::any_of(e.properties, is_wanted);
        });
    };
    for (const char* axis : {"x", "y", "z"})
        if (!has("vertex", [&](const Property& p) { return p.name == axis; }))
            fail(fmt::format("PLY header: no vertex property \"{}\"", axis));
    if (!has("face", is_corner_list) && !has("tristrips", is_corner_list))
        fail("PLY header: no face property \"vertex_indices\", and no triangle strips");

    PolygonSoup soup;
    Numbers numbers(std::string_view(data).substr(header.size), header.encoding);
    for (const Element& element : header.elements) read_element(element, numbers, soup);
    return soup;
}

}  // namespace nbd
