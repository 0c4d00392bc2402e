#include "meshing/formats/face_count.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>

namespace nbd {
namespace {

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

std::uint64_t faces_of_obj(std::ifstream& file) {
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

}  // namespace

std::uint64_t estimate_faces(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) return 0;
    const std::uint64_t bytes = std::filesystem::file_size(path, error);
    std::ifstream file(path, std::ios::binary);
    if (error || !file) return 0;
    std::string extension = path.extension().string();
    std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
    if (extension == ".ply") return faces_of_ply(file, bytes);
    if (extension == ".off") return faces_of_off(file, bytes);
    if (extension == ".stl") return faces_of_stl(file, bytes);
    if (extension == ".obj") return faces_of_obj(file);
    constexpr std::uint64_t bytes_in_glb = 24;  // three indices, and half a vertex of a position alone
    return extension == ".glb" ? bytes / bytes_in_glb : 0;
}

}  // namespace nbd
