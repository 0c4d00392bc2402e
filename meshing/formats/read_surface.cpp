#include "meshing/formats/read_surface.hpp"

#include <assimp/BaseImporter.h>
#include <assimp/DefaultIOSystem.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cstddef>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "collision/base/shortened.hpp"
#include "meshing/checks/check_glb.hpp"
#include "meshing/checks/check_obj.hpp"
#include "meshing/formats/polygon_soup.hpp"
#include "meshing/formats/read_off.hpp"
#include "meshing/formats/read_ply.hpp"
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

void append(const aiMesh& mesh, const aiMatrix4x4& transform, PolygonSoup& soup) {
    const auto base = static_cast<std::int64_t>(soup.X.size());
    const bool stays = transform.IsIdentity();  // keeps every bit of the positions
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
        const aiVector3D x = stays ? mesh.mVertices[v] : transform * mesh.mVertices[v];
        soup.X.push_back({x.x, x.y, x.z});
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
        const aiFace& face = mesh.mFaces[f];
        if (face.mNumIndices < 3) continue;
        for (unsigned c = 0; c < face.mNumIndices; ++c) {
            // An index beyond its own group must not refer to a vertex of the next group.
            if (face.mIndices[c] >= mesh.mNumVertices)
                throw std::runtime_error(fmt::format("face {} refers to vertex {} of a group of {} vertices",
                                                     soup.face_count(), face.mIndices[c], mesh.mNumVertices));
            soup.corners.push_back(base + face.mIndices[c]);
        }
        soup.face_end.push_back(soup.corners.size());
    }
}

void append(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, PolygonSoup& soup) {
    const aiMatrix4x4 transform = parent * node.mTransformation;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) append(*scene.mMeshes[node.mMeshes[i]], transform, soup);
    for (unsigned i = 0; i < node.mNumChildren; ++i) append(scene, *node.mChildren[i], transform, soup);
}

/// Opens one file and no other, such as a material library that a surface names.
class OneFile : public Assimp::DefaultIOSystem {
 public:
    explicit OneFile(std::string path) : path_(std::move(path)) {}

    bool Exists(const char* path) const override { return path == path_; }
    Assimp::IOStream* Open(const char* path, const char* mode) override {
        return path == path_ ? DefaultIOSystem::Open(path, mode) : nullptr;
    }

 private:
    std::string path_;
};

/// Takes away the importers of other files. Where a file does not begin as its name says, assimp would try
/// all that it has, some of which trust a file's numbers.
void keep_importers_of(const std::string& extension, Assimp::Importer& importer) {
    for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
        Assimp::BaseImporter* reader = importer.GetImporter(i);
        std::set<std::string> extensions;
        reader->GetExtensionList(extensions);
        if (extensions.contains(extension.substr(1))) continue;
        importer.UnregisterLoader(reader);
        delete reader;  // which is the caller's now
    }
}

/// Runs only the validation step of assimp's post-processing: the other steps abort the process or drop faces
/// on damaged input.
PolygonSoup read_by_assimp(const fs::path& path, const std::string& extension) {
    Assimp::Importer importer;
    keep_importers_of(extension, importer);
    importer.SetIOHandler(new OneFile(path.string()));  // which the importer deletes
    const aiScene* scene = importer.ReadFile(path.string(), aiProcess_ValidateDataStructure);
    if (!scene || !scene->mRootNode) throw std::runtime_error(importer.GetErrorString());
    PolygonSoup soup;
    append(*scene, *scene->mRootNode, aiMatrix4x4(), soup);
    return soup;
}

}  // namespace

TriMesh read_surface(const fs::path& path) try {
    const std::string extension = check_file(path);
    if (extension == ".glb") check_glb(path);
    if (extension == ".obj") check_obj(path);
    return weld(triangulate(extension == ".ply"   ? read_ply(path)
                            : extension == ".off" ? read_off(path)
                                                  : read_by_assimp(path, extension)));
} catch (const std::exception& error) {
    std::string reason = shortened(error.what(), 300);  // assimp quotes the rest of the file
    std::ranges::replace_if(
        reason, [](unsigned char c) { return std::iscntrl(c); }, ' ');
    throw std::runtime_error(fmt::format("{}: {}", path.string(), reason));
}

}  // namespace nbd
