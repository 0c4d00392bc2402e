#include "meshing/formats/read_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "collision/base/file_name.hpp"
#include "meshing/formats/surface_formats.hpp"
#include "meshing/surface/weld.hpp"

namespace nbd {
namespace {

namespace fs = std::filesystem;

struct SurfaceFormat {
    std::string_view extension;
    PolygonSoup (*read)(const fs::path& path);
};
constexpr SurfaceFormat formats[] = {
    {".obj", read_obj}, {".ply", read_ply}, {".stl", read_stl}, {".off", read_off}, {".glb", read_glb}};

/// Checks that the path is a readable, non-empty file of a known kind.
const SurfaceFormat& check_file(const fs::path& path) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status)) throw std::runtime_error("no such file");
    if (fs::is_directory(status)) throw std::runtime_error("is a directory, not a surface file");
    if (!fs::is_regular_file(status)) throw std::runtime_error("is a special file, not a surface file");
    const auto* const format =
        std::ranges::find_if(formats, [&](const auto& f) { return has_extension(path, f.extension); });
    if (format == std::end(formats))
        throw std::runtime_error(
            fmt::format("unknown kind of surface file \"{}\"; allowed: .obj .ply .stl .off .glb",
                        path.extension().string()));
    std::ifstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error("cannot be opened for reading");
    if (file.peek() == std::ifstream::traits_type::eof()) throw std::runtime_error("the file is empty");
    return *format;
}

/// Without those of all triangles.
std::vector<FaceGroup> groups_of_triangles(const PolygonSoup& soup, const std::vector<int>& face_of) {
    std::vector<int> first(soup.face_count() + 1, 0);  // of the triangles of a face, which are in order
    for (const int face : face_of) ++first[face + 1];
    for (std::size_t f = 1; f < first.size(); ++f) first[f] += first[f - 1];
    std::vector<FaceGroup> result;
    for (const FaceGroup& group : soup.groups) {
        std::vector<int> faces = group.faces;
        std::ranges::sort(faces);
        faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
        FaceGroup mine{.name = group.name, .faces = {}};
        for (const int face : faces)
            for (int t = first[face]; t < first[face + 1]; ++t) mine.faces.push_back(t);
        if (!mine.faces.empty() && mine.faces.size() < face_of.size()) result.push_back(std::move(mine));
    }
    return result;
}

}  // namespace

TriMesh read_surface(const fs::path& path, std::vector<FaceGroup>* groups) try {
    const PolygonSoup soup = check_file(path).read(path);
    std::vector<int> face_of;
    TriMesh mesh = weld(triangulate(soup, &face_of));
    if (groups) *groups = groups_of_triangles(soup, face_of);
    return mesh;
} catch (const std::exception& error) {
    const std::string reason = error.what();
    if (reason.starts_with(path.string())) throw;  // names the place in the file, too
    throw std::runtime_error(fmt::format("{}: {}", path.string(), reason));
}

}  // namespace nbd
