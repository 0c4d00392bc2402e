#include "meshing/formats/read_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "collision/base/file_name.hpp"
#include "meshing/formats/surface_formats.hpp"
#include "meshing/surface/weld.hpp"

namespace nbd {
namespace {

namespace fs = std::filesystem;

std::string head_of(std::ifstream& file) {
    constexpr std::streamsize size = 65536;
    std::string head(size, '\0');
    file.read(head.data(), size);
    head.resize(file.gcount());
    return head;
}

std::uint64_t faces_of_ply(std::ifstream& file, std::uint64_t bytes) {
    std::istringstream head(head_of(file));
    std::string line, word, name;
    std::uint64_t faces = 0;
    while (std::getline(head, line) && !line.starts_with("end_header")) {
        std::istringstream words(line);
        std::uint64_t count = 0;
        if (!(words >> word >> name >> count) || word != "element") continue;
        if (name == "face") faces += count;
        if (name == "tristrips" && count > 0)
            faces += bytes / 8;  // the strips' lengths are not in the header
    }
    return std::min(faces, bytes / 4);
}

std::uint64_t faces_of_off(std::ifstream& file, std::uint64_t bytes) {
    std::istringstream head(head_of(file));
    std::string line, text;
    while (std::getline(head, line)) text += line.substr(0, line.find('#')) + "\n";
    std::istringstream words(text);
    std::string keyword;
    std::uint64_t vertices = 0, faces = 0;
    words >> keyword >> vertices >> faces;
    return std::min(faces, bytes / 8);
}

std::uint64_t faces_of_stl(std::ifstream& file, std::uint64_t bytes) {
    std::array<char, 84> head{};
    file.read(head.data(), head.size());
    std::uint32_t faces = 0;
    std::memcpy(&faces, head.data() + 80, sizeof faces);
    if constexpr (std::endian::native == std::endian::big) faces = __builtin_bswap32(faces);
    const bool is_binary = 84 + 50 * std::uint64_t{faces} == bytes;
    constexpr std::uint64_t bytes_as_text = 200;
    return is_binary ? faces : bytes / bytes_as_text;
}

std::uint64_t faces_of_obj(std::ifstream& file, std::uint64_t) {
    std::string block(1 << 20, '\0');
    std::uint64_t faces = 0;
    char before = '\n';
    while (file.read(block.data(), block.size()), file.gcount() > 0)
        for (const char c : std::string_view(block.data(), file.gcount())) {
            faces += c == 'f' && before == '\n';
            before = c;
        }
    return faces;
}

std::uint64_t faces_of_glb(std::ifstream&, std::uint64_t bytes) {
    constexpr std::uint64_t bytes_of_face = 24;  // three indices, and half a vertex of a position alone
    return bytes / bytes_of_face;
}

struct SurfaceFormat {
    std::string_view extension;
    PolygonSoup (*read)(const fs::path& path);
    std::uint64_t (*estimate_faces)(std::ifstream& file, std::uint64_t bytes);
};
constexpr SurfaceFormat formats[] = {{".obj", read_obj, faces_of_obj},
                                     {".ply", read_ply, faces_of_ply},
                                     {".stl", read_stl, faces_of_stl},
                                     {".off", read_off, faces_of_off},
                                     {".glb", read_glb, faces_of_glb}};

/// Null for a file of another kind.
const SurfaceFormat* format_of(const fs::path& path) {
    const auto* const found =
        std::ranges::find_if(formats, [&](const auto& f) { return has_extension(path, f.extension); });
    return found == std::end(formats) ? nullptr : found;
}

/// Checks that the path is a readable, non-empty file of a known kind.
const SurfaceFormat& check_file(const fs::path& path) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status)) throw std::runtime_error("no such file");
    if (fs::is_directory(status)) throw std::runtime_error("is a directory, not a surface file");
    if (!fs::is_regular_file(status)) throw std::runtime_error("is a special file, not a surface file");
    const SurfaceFormat* const format = format_of(path);
    if (!format)
        throw std::runtime_error(
            fmt::format("unknown kind of surface file \"{}\"; allowed: .obj .ply .stl .off .glb",
                        path.extension().string()));
    std::ifstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error("cannot be opened for reading");
    if (file.peek() == std::ifstream::traits_type::eof()) throw std::runtime_error("the file is empty");
    return *format;
}

}  // namespace

TriMesh read_surface(const fs::path& path) try {
    return weld(triangulate(check_file(path).read(path)));
} catch (const std::exception& error) {
    const std::string reason = error.what();
    if (reason.starts_with(path.string())) throw;  // names the place in the file, too
    throw std::runtime_error(fmt::format("{}: {}", path.string(), reason));
}

std::uint64_t estimate_faces(const fs::path& path) {
    std::error_code error;
    const SurfaceFormat* const format = format_of(path);
    if (!format || !fs::is_regular_file(path, error)) return 0;
    const std::uint64_t bytes = fs::file_size(path, error);
    std::ifstream file(path, std::ios::binary);
    return error || !file ? 0 : format->estimate_faces(file, bytes);
}

}  // namespace nbd
