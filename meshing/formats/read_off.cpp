#include <fmt/format.h>

#include <string>

#include "meshing/formats/file_cursor.hpp"
#include "meshing/formats/surface_formats.hpp"
#include "meshing/formats/words.hpp"

namespace nbd {

PolygonSoup read_off(const std::filesystem::path& path) {
    FileCursor in(path);
    in.blank_comments('#');
    const std::string first_word(in.word());
    if (!first_word.ends_with("OFF")) in.fail("the file does not start with \"OFF\"");
    if (first_word.find_first_of("4n") != first_word.npos)
        in.fail(fmt::format("\"{}\" is not three-dimensional", printable(first_word)));
    const std::size_t vertices = in.count("vertices", 2), faces = in.count("faces", 2);
    in.rest_of_line();  // the number of edges
    PolygonSoup soup;
    for (std::size_t v = 0; v < vertices; ++v) {
        if (in.at_end()) in.fail(fmt::format("the file ends early, before vertex {} of {}", v, vertices));
        std::array<double, 3> x;
        for (double& coordinate : x) {
            if (in.at_line_end()) in.fail(fmt::format("vertex {} of {} ends early", v, vertices));
            coordinate = in.real64();
        }
        in.rest_of_line();  // a colour
        soup.X.push_back(x);
    }
    for (std::size_t f = 0; f < faces; ++f) {
        if (in.at_end()) in.fail(fmt::format("the file ends early, before face {} of {}", f, faces));
        const std::size_t corners = in.count("corners", 2);
        for (std::size_t c = 0; c < corners; ++c) soup.corners.push_back(in.int64());
        in.rest_of_line();
        soup.face_end.push_back(soup.corners.size());
    }
    return soup;
}

}  // namespace nbd
