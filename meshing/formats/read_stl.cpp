#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

#include "meshing/formats/file_cursor.hpp"
#include "meshing/formats/surface_formats.hpp"
#include "meshing/formats/words.hpp"

namespace nbd {
namespace {

constexpr std::uint64_t header_bytes = 84, facet_bytes = 50;

std::string lower(std::string_view word) {
    std::string text(word);
    std::ranges::transform(text, text.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text;
}

PolygonSoup read_binary(FileCursor& in, std::uint32_t facets) {
    in.move_to(header_bytes);
    PolygonSoup soup;
    for (std::uint32_t f = 0; f < facets; ++f) {
        in.skip(12);  // the normal
        for (int corner = 0; corner < 3; ++corner) {
            std::array<double, 3> x{};
            for (double& coordinate : x) coordinate = in.real32();
            soup.corners.push_back(soup.X.size());
            soup.X.push_back(x);
        }
        in.skip(2);  // attributes
        soup.face_end.push_back(soup.corners.size());
    }
    return soup;
}

/// A facet is: facet normal X Y Z, outer loop, three or more times vertex X Y Z, endloop, endfacet.
PolygonSoup read_text(FileCursor& in) {
    PolygonSoup soup;
    bool in_facet = false, in_loop = false;
    while (!in.at_end()) {
        const std::string word = lower(in.word());
        if (!in_facet && word.ends_with("solid")) {  // also "endsolid", and behind a byte order mark
            in.rest_of_line();                       // a name
        } else if (!in_facet && word == "facet") {
            in_facet = true;
            if (lower(in.word()) != "normal") in.fail("expected normal after facet");
            for (int k = 0; k < 3; ++k) in.word();
        } else if (in_facet && !in_loop && word == "outer") {
            in_loop = true;
            if (lower(in.word()) != "loop") in.fail("expected loop after outer");
        } else if (in_loop && word == "vertex") {
            std::array<double, 3> x{};
            for (double& coordinate : x) coordinate = in.real64();
            soup.corners.push_back(soup.X.size());
            soup.X.push_back(x);
        } else if (in_loop && word == "endloop") {
            const std::size_t begin = soup.face_end.empty() ? 0 : soup.face_end.back();
            if (soup.corners.size() - begin < 3)
                in.fail(fmt::format("facet {} has {} vertices; allowed: at least 3", soup.face_count(),
                                    soup.corners.size() - begin));
            soup.face_end.push_back(soup.corners.size());
            in_loop = false;
        } else if (in_facet && !in_loop && word == "endfacet") {
            in_facet = false;
        } else {
            in.fail(fmt::format("expected {}, found '{}'",
                                in_loop    ? "vertex or endloop"
                                : in_facet ? "outer loop or endfacet"
                                           : "facet or endsolid",
                                printable(word)));
        }
    }
    if (in_facet) in.fail("the file ends early, in a facet");
    return soup;
}

}  // namespace

PolygonSoup read_stl(const std::filesystem::path& path) {
    FileCursor in(path);
    const std::uint64_t bytes = in.bytes().size();
    std::string begin = lower(in.bytes().substr(0, 4096));  // behind white space and a byte order mark
    if (begin.starts_with("\xEF\xBB\xBF")) begin.erase(0, 3);
    begin.erase(0, begin.find_first_not_of(" \t\r\n\v\f"));
    const bool is_text = begin.starts_with("solid") &&
                         (begin.find("facet") != begin.npos || begin.find("endsolid") != begin.npos);
    if (bytes < header_bytes) {
        if (is_text) return read_text(in);
        throw std::runtime_error(fmt::format(
            "STL: neither a text that starts with \"solid\" nor a binary file: {} bytes; allowed: "
            "at least {}",
            bytes, header_bytes));
    }
    in.move_to(header_bytes - sizeof(std::uint32_t));
    in.read_binary(std::endian::native == std::endian::big);
    const auto facets = in.number<std::uint32_t>();
    const std::uint64_t needed = header_bytes + facet_bytes * std::uint64_t{facets};
    if (is_text && needed != bytes) {
        in.move_to(0);
        in.read_text();
        return read_text(in);
    }
    if (needed > bytes)
        throw std::runtime_error(fmt::format(
            "STL: the file ends early: {} facets take {} bytes, but it has {}", facets, needed, bytes));
    return read_binary(in, facets);
}

}  // namespace nbd
