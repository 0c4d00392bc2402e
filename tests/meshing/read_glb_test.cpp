#include <gtest/gtest.h>

#include <cstdint>
#include <nlohmann/json.hpp>

#include "meshing/formats/read_surface.hpp"
#include "meshing/formats/surface_formats.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using namespace test;
using nlohmann::json;

template <class T>
void append(std::string& bytes, std::initializer_list<T> values) {
    for (const T value : values) bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// A tetrahedron whose corners are 16-bit integers, in thousandths, each followed by two bytes of padding.
class ReadGlb : public testing::Test {
 protected:
    ReadGlb() {
        append<std::int16_t>(data, {0, 0, 0, 0, 1000, 0, 0, 0, 0, 1000, 0, 0, 0, 0, 1000, 0});
        append<std::uint8_t>(data, {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3});
        scene = json::parse(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
            "nodes":[{"mesh":0,"scale":[0.001,0.001,0.001]}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
            "accessors":[{"bufferView":0,"componentType":5122,"count":4,"type":"VEC3"},
                         {"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}],
            "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":32,"byteStride":8},
                           {"buffer":0,"byteOffset":32,"byteLength":12}],
            "buffers":[{"byteLength":44}],
            "extensionsUsed":["KHR_mesh_quantization"],"extensionsRequired":["KHR_mesh_quantization"]})");
    }

    std::filesystem::path write() { return folder_.write("a.glb", glb_of(scene.dump(), data)); }
    TriMesh read() { return read_surface(write()); }
    std::string refusal() { return reading_error(write()); }

    json scene;
    std::string data;

 private:
    TemporaryFolder folder_;
};

TEST_F(ReadGlb, ReadsQuantizedPositions) {
    const TriMesh mesh = read();
    EXPECT_EQ(mesh.F.rows(), 4);
    EXPECT_TRUE(mesh.X.isApprox((Nodes(4, 3) << 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0).finished())) << mesh.X;
}

TEST_F(ReadGlb, ReadsNormalizedPositions) {
    scene["accessors"][0]["normalized"] = true;
    scene["nodes"][0]["scale"] = {32.767, 32.767, 32.767};
    EXPECT_NEAR(read().X.maxCoeff(), 1, 1e-12);
}

TEST_F(ReadGlb, RefusesUnknownRequiredExtensionsByName) {
    for (const char* name :
         {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "EXT_mesh_gpu_instancing"}) {
        scene["extensionsRequired"] = {"KHR_mesh_quantization", name};
        EXPECT_NE(refusal().find("glTF: the file requires the extension " + std::string(name)),
                  std::string::npos)
            << refusal();
    }
    scene["extensionsRequired"] = {"KHR_materials_unlit", "KHR_texture_transform"};
    EXPECT_EQ(refusal(), "");
}

TEST_F(ReadGlb, ReadsStripsFansAndPrimitivesWithoutIndices) {
    scene["accessors"][1]["count"] = 4;  // 0 2 1 0
    scene["meshes"][0]["primitives"][0]["mode"] = 5;
    EXPECT_EQ(read().F, (Faces(2, 3) << 0, 2, 1, 1, 2, 0).finished());
    scene["meshes"][0]["primitives"][0]["mode"] = 6;
    EXPECT_EQ(read().F, (Faces(2, 3) << 0, 2, 1, 0, 1, 0).finished());
    scene["meshes"][0]["primitives"][0].erase("indices");
    EXPECT_EQ(read().F, (Faces(2, 3) << 0, 1, 2, 0, 2, 3).finished());
    scene["meshes"][0]["primitives"][0]["mode"] = 1;
    EXPECT_NE(refusal().find("no faces in the file"), std::string::npos);
}

TEST_F(ReadGlb, ReadsSparsePositions) {
    append<std::uint8_t>(data, {3, 0});
    append<std::int16_t>(data, {0, 0, 2000});
    scene["buffers"][0]["byteLength"] = 52;
    scene["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", 44}, {"byteLength", 1}});
    scene["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", 46}, {"byteLength", 6}});
    scene["accessors"][0]["sparse"] = {{"count", 1},
                                       {"indices", {{"bufferView", 2}, {"componentType", 5121}}},
                                       {"values", {{"bufferView", 3}}}};
    EXPECT_NEAR(read().X.row(3)[1], -2, 1e-12);
}

TEST_F(ReadGlb, TurnsTheFacesOfAMirroredNode) {
    const Faces F = read().F;
    scene["nodes"][0]["scale"] = {-0.001, 0.001, 0.001};
    const Faces turned = read().F;
    EXPECT_EQ(turned.col(1), F.col(2));
    EXPECT_EQ(turned.col(0), F.col(0));
}

TEST_F(ReadGlb, RefusesANodeBeyond32Bits) {
    scene["scenes"][0]["nodes"] = {std::uint64_t{1} << 32};
    EXPECT_NE(refusal().find("there is no 4294967296 of \"nodes\", which has 1"), std::string::npos)
        << refusal();
}

TEST_F(ReadGlb, RefusesDataThatDoNotFit) {
    const json good = scene;
    const std::vector<std::pair<std::string, json>> cases = {
        {"numbers of an accessor do not fit", {{"/accessors/0/count", 5}}},
        {"numbers of an accessor do not fit", {{"/accessors/1/count", 13}}},
        {"\"count\" is not a whole number", {{"/accessors/0/count", "many"}}},
        {"items; allowed: 0 to", {{"/accessors/0/count", -1}}},
        {"a view takes", {{"/bufferViews/0/byteLength", 45}}},
        {"a view takes", {{"/bufferViews/0/byteOffset", 4611686018427387903}}},
        {"bytes apart; allowed", {{"/bufferViews/0/byteStride", 4}}},
        {"there is no 7 of \"bufferViews\"", {{"/accessors/0/bufferView", 7}}},
        {"there is no 3 of \"accessors\"", {{"/meshes/0/primitives/0/indices", 3}}},
        {"accessor 0 is not of type SCALAR", {{"/meshes/0/primitives/0/indices", 0}}},
        {"accessor 1 has numbers of type 5126", {{"/accessors/1/componentType", 5126}}},
        {"lies in another file, body.bin", {{"/buffers/0/uri", "body.bin"}}},
        {"node 0 is named twice", {{"/scenes/0/nodes", {0, 0}}}},
        {"mode 9; allowed: 0 to 6", {{"/meshes/0/primitives/0/mode", 9}}}};
    for (const auto& [problem, changes] : cases) {
        scene = good;
        for (const auto& [place, value] : changes.items()) scene[json::json_pointer(place)] = value;
        EXPECT_NE(refusal().find(problem), std::string::npos) << refusal() << "\n" << problem;
    }
    scene = good;
    data[33] = 9;
    EXPECT_NE(refusal().find("face 0 refers to vertex 9 of a primitive of 4 vertices"), std::string::npos)
        << refusal();
}

TEST_F(ReadGlb, ReadsBuffersInTheText) {
    scene["buffers"][0]["uri"] =
        "data:application/octet-stream;base64,"
        "AAAAAAAAAADoAwAAAAAAAAAA6AMAAAAAAAAAAOgDAAAAAgEAAQMBAgMCAAM=";
    EXPECT_EQ(read().F.rows(), 4);
    scene["buffers"][0]["uri"] = "data:application/octet-stream;base64,AAA";
    EXPECT_NE(refusal(), "");
}

/// A .glb file of which node 0 is the first of a chain of `length` more.
std::string chain_of_nodes(int length) {
    std::string nodes = "\"children\":[1]}";
    for (int n = 1; n < length; ++n) nodes += ",{\"children\":[" + std::to_string(n + 1) + "]}";
    return glb_file(tetrahedron(), nodes + ",{\"name\":\"last\"");
}

TEST(ReadSurface, RefusesNodesOrValuesThatAreNestedTooDeeply) {
    const TemporaryFolder folder;
    EXPECT_EQ(read_surface(folder.write("some.glb", chain_of_nodes(500))).F.rows(), 4);
    EXPECT_NE(reading_error(folder.write("deep.glb", chain_of_nodes(200'000)))
                  .find("nodes are nested more than 1000"),
              std::string::npos);
    const std::string values = "\"extras\":" + std::string(100'000, '[') + std::string(100'000, ']');
    EXPECT_NE(
        reading_error(folder.write("values.glb", glb_file(tetrahedron(), values))).find("values are nested"),
        std::string::npos);
    EXPECT_NE(reading_error(folder.write("cycle.glb", glb_file(tetrahedron(), "\"children\":[0]"))), "");
}

TEST(ReadSurface, RefusesAJsonTextThatIsLongerThanTheFile) {
    const TemporaryFolder folder;
    std::string file = glb_file(tetrahedron());
    file[15] = 9;  // the highest byte of the text's length
    EXPECT_NE(reading_error(folder.write("long.glb", file)).find("its JSON text has 15"), std::string::npos);
}

}  // namespace
}  // namespace nbd
