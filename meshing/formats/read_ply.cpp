#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "meshing/formats/file_cursor.hpp"
#include "meshing/formats/surface_formats.hpp"
#include "meshing/formats/words.hpp"

namespace nbd {
namespace {

using ReadNumber = double (*)(FileCursor& in);

template <class T>
double read_number(FileCursor& in) {
    return static_cast<double>(in.number<T>());
}

struct Type {
    std::string_view name, name_by_bits;
    ReadNumber read_bytes;
    bool is_integer = true;
};
constexpr Type types[] = {
    {"char", "int8", read_number<std::int8_t>},      {"uchar", "uint8", read_number<std::uint8_t>},
    {"short", "int16", read_number<std::int16_t>},   {"ushort", "uint16", read_number<std::uint16_t>},
    {"int", "int32", read_number<std::int32_t>},     {"uint", "uint32", read_number<std::uint32_t>},
    {"float", "float32", read_number<float>, false}, {"double", "float64", read_number<double>, false}};

struct Property {
    std::string name;
    ReadNumber read = nullptr, read_count = nullptr;  // read_count: of a list
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties{};
};

class Header {
 public:
    /// Reads the header and switches the numbers behind it to its encoding.
    explicit Header(FileCursor& in) : in_(in) {
        if (!in_.is_next("ply") || in_.word() != "ply") fail("the file does not start with \"ply\"");
        for (;;) {
            if (in_.at_end()) fail("ends before \"end_header\"");
            std::istringstream words{std::string(in_.line())};
            std::string word;
            words >> word;
            if (word == "end_header") break;
            if (word == "format") {
                words >> encoding_;
                if (encoding_ != "ascii" && !is_binary())
                    fail(
                        fmt::format("unknown format \"{}\"; allowed: ascii, binary_little_endian and "
                                    "binary_big_endian",
                                    printable(encoding_)));
            } else if (word == "element") {
                if (encoding_.empty()) fail("no \"format\" line before the elements");
                Element element;
                if (!(words >> element.name >> element.count)) fail("an element has no count");
                elements.push_back(std::move(element));
            } else if (word == "property") {
                if (elements.empty()) fail("a property comes before the first element");
                elements.back().properties.push_back(property(words));
            } else if (word != "comment" && word != "obj_info" && !word.empty()) {
                fail(fmt::format("unknown keyword \"{}\"", printable(word)));
            }
        }
        const bool is_big = encoding_ == "binary_big_endian";
        if (is_binary()) in_.read_binary(is_big != (std::endian::native == std::endian::big));
    }

    [[noreturn]] void fail(const std::string& what) const { in_.fail("PLY header: " + what); }

    bool is_binary() const { return encoding_ == "binary_little_endian" || encoding_ == "binary_big_endian"; }

    std::vector<Element> elements;

 private:
    Property property(std::istringstream& words) const {
        Property property;
        std::string type;
        words >> type;
        if (type == "list") {
            words >> type;
            property.read_count = reader(type, true);
            words >> type;
        }
        property.read = reader(type, false);
        words >> property.name;
        return property;
    }

    ReadNumber reader(const std::string& name, bool of_count) const {
        for (const Type& type : types)
            if (name == type.name || name == type.name_by_bits) {
                if (of_count && !type.is_integer) fail("a list's count must be an integer");
                return is_binary() ? type.read_bytes : read_number<double>;
            }
        fail(fmt::format("unknown type \"{}\"", printable(name)));
    }

    FileCursor& in_;
    std::string encoding_;
};

bool is_corner_list(const Property& p) {
    return p.read_count && (p.name == "vertex_indices" || p.name == "vertex_index");
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

void read_element(const Element& element, bool is_binary, FileCursor& in, PolygonSoup& soup) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face",
               is_strips = element.name == "tristrips";
    Strips strips(soup);
    if (element.properties.empty()) return;  // has no data, whatever its count
    for (std::size_t i = 0; i < element.count; ++i) {
        if (is_binary ? in.bytes_left() == 0 : in.at_end())
            in.fail(fmt::format("the file ends early, in {} {} of {}", printable(element.name), i,
                                element.count));
        std::array<double, 3> x{};
        for (const Property& property : element.properties) {
            const double count = property.read_count ? property.read_count(in) : 1;
            if (!(count >= 0) || count != std::floor(count))
                in.fail(fmt::format("{} {} has a list of {} entries", printable(element.name), i, count));
            const bool is_corners = (is_face || is_strips) && is_corner_list(property);
            for (double k = 0; k < count; ++k) {
                const double value = property.read(in);
                if (is_vertex && property.name.size() == 1 && property.name[0] >= 'x' &&
                    property.name[0] <= 'z')
                    x[property.name[0] - 'x'] = value;
                if (!is_corners) continue;
                if (!(std::abs(value) < 1e15) || value != std::floor(value))
                    in.fail(fmt::format("{} {} refers to vertex {}", is_face ? "face" : "strip", i, value));
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
    FileCursor in(path);
    const Header header(in);
    const auto has = [&](std::string_view element, auto is_wanted) {
        return std::ranges::any_of(header.elements, [&](const Element& e) {
            return e.name == element && std::ranges::any_of(e.properties, is_wanted);
        });
    };
    for (const char* axis : {"x", "y", "z"})
        if (!has("vertex", [&](const Property& p) { return p.name == axis; }))
            header.fail(fmt::format("no vertex property \"{}\"", axis));
    if (!has("face", is_corner_list) && !has("tristrips", is_corner_list))
        header.fail("no face property \"vertex_indices\", and no triangle strips");

    PolygonSoup soup;
    for (const Element& element : header.elements) read_element(element, header.is_binary(), in, soup);
    return soup;
}

}  // namespace nbd
