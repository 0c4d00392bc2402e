#include "meshing/formats/read_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "meshing/formats/polygon_soup.hpp"
#include "meshing/formats/read_glb.hpp"
#include "meshing/formats/read_obj.hpp"
#include "meshing/formats/read_off.hpp"
#include "meshing/formats/read_ply.hpp"
#include "meshing/formats/read_stl.hpp"
#include "meshing/surface/weld.hpp"

namespace nbd {
namespace {

namespace fs = std::filesystem;

/// Checks that the path is a readable, non-empty file of a known kind. Returns the extension in lower case.
std::string check_file(const fs::path& path) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status)) throw std::runtime_error("no such file");
    if (fs::is_directory(status)) throw std::runtime_error("is a directory, not a surface file");
    if (!fs::is_regular_file(status)) throw std::runtime_error("is a special file, not a surface file");
    std::string extension = path.extension().string();
    std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
    static constexpr std::array<std::string_view, 5> known = {".obj", ".ply", ".stl", ".off", ".glb"};
    if (std::ranges::find(known, extension) == known.end())
        throw std::runtime_error(fmt::format("unknown kind of surface file \"{}\"; allowed: {}", extension,
                                             fmt::join(known, " ")));
    std::ifstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error("cannot be opened for reading");
    if (file.peek() == std::ifstream::traits_type::eof()) throw std::runtime_error("the file is empty");
    return extension;
}

PolygonSoup read_soup(const fs::path& path, const std::string& extension) {
    if (extension == ".obj") return read_obj(path);
    if (extension == ".ply") return read_ply(path);
    if (extension == ".stl") return read_stl(path);
    if (extension == ".off") return read_off(path);
    return read_glb(path);
}

}  // namespace

TriMesh read_surface(const fs::path& path) try {
    const std::string extension = check_file(path);
    return weld(triangulate(read_soup(path, extension)));
} catch (const std::exception& error) {
    const std::string reason = error.what();
    if (reason.starts_with(path.string())) throw;  // names the place in the file, too
    throw std::runtime_error(fmt::format("{}: {}", path.string(), reason));
}

}  // namespace nbd
