#include <fmt/format.h>

#include <cctype>
#include <string>

#include "meshing/formats/tet_formats.hpp"

namespace nbd {
namespace {

/// The next word outside comments (# to the end of the line); "End" at the end of the file, which many
/// programs leave out.
std::string_view next_word(FileCursor& in) {
    while (!in.at_end()) {
        const std::string_view word = in.word();
        if (!word.starts_with('#')) return word;
        in.rest_of_line();
    }
    return "End";
}

bool is_keyword(std::string_view word) {
    return std::isalpha(static_cast<unsigned char>(word.front())) && word != "nan" && word != "inf";
}

bool is_volume(std::string_view keyword) {
    return keyword == "Hexahedra" || keyword == "Hexaedra" || keyword == "Prisms" || keyword == "Pyramids" ||
           keyword.starts_with("TetrahedraP") || keyword.starts_with("HexahedraQ");
}

/// Reads the corners of a cell, which count from 1.
template <std::size_t count>
std::array<int, count> read_corners(FileCursor& in, const char* what, std::size_t index, std::size_t nodes) {
    std::array<int, count> corners{};
    for (int& corner : corners) {
        const std::int64_t node = in.int64();
        if (node < 1 || node > static_cast<std::int64_t>(nodes))
            in.fail(fmt::format("{} {} refers to node {}; allowed: 1 to {}", what, index, node, nodes));
        corner = static_cast<int>(node - 1);
    }
    return corners;
}

bool is_surface_or_line(std::string_view keyword) {
    return keyword == "Triangles" || keyword == "Quadrilaterals" || keyword == "Edges";
}

}  // namespace

TetFileContent read_medit(FileCursor& in) {
    TetFileContent content;
    if (next_word(in) != "MeshVersionFormatted") in.fail("expected MeshVersionFormatted");
    in.int32();
    std::string keyword(next_word(in));
    while (keyword != "End") {
        if (!is_keyword(keyword)) in.fail("expected a keyword");
        if (keyword == "Dimension") {
            if (const int dimension = in.int32(); dimension != 3)
                in.fail(fmt::format("dimension is {}; allowed: 3", dimension));
        } else if (keyword == "Vertices") {
            if (!content.nodes.empty()) in.fail("a second list of vertices");
            content.nodes.resize(in.count("vertices", 8));
            for (auto& node : content.nodes) {
                for (double& coordinate : node) coordinate = in.real64();
                in.int32();  // reference
            }
        } else if (keyword == "Tetrahedra") {
            if (!content.tets.empty()) in.fail("a second list of tetrahedra");
            if (content.nodes.empty()) in.fail("tetrahedra before the vertices");
            content.tets.resize(in.count("tetrahedra", 10));
            for (std::size_t t = 0; t < content.tets.size(); ++t) {
                content.tets[t] = read_corners<4>(in, "tetrahedron", t, content.nodes.size());
                content.group_of_tet.push_back(in.int32());
            }
        } else if (keyword == "Triangles" && !content.nodes.empty()) {
            const std::size_t count = in.count("triangles", 8);
            content.other_cells += static_cast<int>(count);
            for (std::size_t f = 0; f < count; ++f) {
                const std::array<int, 3> triangle = read_corners<3>(in, "triangle", f, content.nodes.size());
                const int group = in.int32();
                if (group == 0) continue;
                content.triangles.push_back(triangle);
                content.group_of_triangle.push_back(group);
            }
        } else {
            // Skips an unused list: numbers up to the next keyword.
            if (is_volume(keyword) && in.count("cells", 2) > 0)
                in.fail(fmt::format("holds {}; only 4-node tetrahedra are allowed", keyword));
            if (is_surface_or_line(keyword))
                content.other_cells += in.count("cells", 4);
            else if (!is_volume(keyword) && in.at_end())
                in.fail(fmt::format("the file ends early, behind {}", keyword));
            std::string_view word = next_word(in);
            while (!is_keyword(word)) word = next_word(in);
            keyword = word;
            continue;
        }
        keyword = next_word(in);
    }
    return content;
}

}  // namespace nbd
