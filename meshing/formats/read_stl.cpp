#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <fstream>
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

/// The beginning of a file in lower case, behind white space and a byte order mark.
std::string beginning(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::string bytes(4096, '\0');
    file.read(bytes.data(), bytes.size());
    bytes.resize(file.gcount());
    if (bytes.starts_with("\xEF\xBB\xBF")) bytes.erase(0, 3);
    bytes.erase(0, bytes.find_first_not_of(" \t\r\n\v\f"));
    return lower(bytes);
}

std::uint32_t facets_of_header(const std::filesystem::path& path) {
    std::array<char, header_bytes> head{};
    std::ifstream(path, std::ios::binary).read(head.data(), head.size());
    std::uint32_t facets = 0;
    std::memcpy(&facets, head.data() + 80, sizeof facets);
    if constexpr (std::endian::native == std::endian::big) facets = __builtin_bswap32(facets);
    return facets;
}

PolygonSoup read_binary(const std::filesystem::path& path, std::uint32_t facets) {
    FileCursor in(path);
    in.skip(header_bytes);
    in.read_binary(std::endian::native == std::endian::big);
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
PolygonSoup read_text(const std::filesystem::path& path) {
    FileCursor in(path);
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
    const std::uint64_t bytes = std::filesystem::file_size(path);
    const std::string begin = beginning(path);
    const std::uint32_t facets = bytes >= header_bytes ? facets_of_header(path) : 0;
    const std::uint64_t needed = header_bytes + facet_bytes * std::uint64_t{facets};
    if (bytes >= header_bytes && needed == bytes) return read_binary(path, facets);
    if (begin.starts_with("solid") &&
        (begin.find("facet") != begin.npos || begin.find("endsolid") != begin.npos))
        return read_text(path);
    if (bytes < header_bytes)
        throw std::runtime_error(fmt::format(
            "STL: neither a text that starts with \"solid\" nor a binary file: {} bytes; allowed: "
            "at least {}",
            bytes, header_bytes));
    if (needed > bytes)
        throw std::runtime_error(fmt::format(
            "STL: the file ends early: {} facets take {} bytes, but it has {}", facets, needed, bytes));
    return read_binary(path, facets);
}

}  // namespace nbd
