#include "tests/meshing/surface_files.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <sstream>

#include "meshing/formats/read_surface.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd::test {
namespace {

std::string ply_header(const TriMesh& mesh, const char* format) {
    std::ostringstream out;
    out << "ply\nformat " << format << " 1.0\ncomment a test\nelement vertex " << mesh.X.rows()
        << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << mesh.F.rows()
        << "\nproperty list uchar int vertex_indices\nend_header\n";
    return out.str();
}

template <class T>
void append_bytes(std::string& out, T value, bool reversed = false) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    for (std::size_t i = 0; i < sizeof value; ++i) out += bytes[reversed ? sizeof value - 1 - i : i];
}

}  // namespace

std::string obj_file(const TriMesh& mesh, int digits) {
    std::ostringstream out;
    out.precision(digits);
    for (int v = 0; v < mesh.X.rows(); ++v)
        out << "v " << mesh.X(v, 0) << ' ' << mesh.X(v, 1) << ' ' << mesh.X(v, 2) << '\n';
    for (int f = 0; f < mesh.F.rows(); ++f)
        out << "f " << mesh.F(f, 0) + 1 << ' ' << mesh.F(f, 1) + 1 << ' ' << mesh.F(f, 2) + 1 << '\n';
    return out.str();
}

std::string off_file(const TriMesh& mesh, int digits) {
    std::ostringstream out;
    out.precision(digits);
    out << "OFF\n" << mesh.X.rows() << ' ' << mesh.F.rows() << " 0\n" << mesh.X << '\n';
    for (int f = 0; f < mesh.F.rows(); ++f) out << "3 " << mesh.F.row(f) << '\n';
    return out.str();
}

std::string ascii_ply_file(const TriMesh& mesh, int digits) {
    std::ostringstream out;
    out.precision(digits);
    out << ply_header(mesh, "ascii") << mesh.X << '\n';
    for (int f = 0; f < mesh.F.rows(); ++f) out << "3 " << mesh.F.row(f) << '\n';
    return out.str();
}

std::string binary_ply_file(const TriMesh& mesh, bool big_endian) {
    std::string out = ply_header(mesh, big_endian ? "binary_big_endian" : "binary_little_endian");
    for (int v = 0; v < mesh.X.rows(); ++v)
        for (int k = 0; k < 3; ++k) append_bytes(out, static_cast<float>(mesh.X(v, k)), big_endian);
    for (int f = 0; f < mesh.F.rows(); ++f) {
        append_bytes(out, std::uint8_t{3});
        for (int k = 0; k < 3; ++k) append_bytes(out, std::int32_t{mesh.F(f, k)}, big_endian);
    }
    return out;
}

std::string ascii_stl_file(const TriMesh& mesh, int digits) {
    std::ostringstream out;
    out.precision(digits);
    out << "solid test\n";
    for (int f = 0; f < mesh.F.rows(); ++f) {
        out << " facet normal 0 0 0\n  outer loop\n";
        for (int k = 0; k < 3; ++k) out << "   vertex " << mesh.X.row(mesh.F(f, k)) << '\n';
        out << "  endloop\n endfacet\n";
    }
    out << "endsolid test\n";
    return out.str();
}

std::string binary_stl_file(const TriMesh& mesh) {
    std::string out(80, ' ');
    append_bytes(out, static_cast<std::uint32_t>(mesh.F.rows()));
    for (int f = 0; f < mesh.F.rows(); ++f) {
        for (int k = 0; k < 3; ++k) append_bytes(out, 0.f);
        for (int c = 0; c < 3; ++c)
            for (int k = 0; k < 3; ++k) append_bytes(out, static_cast<float>(mesh.X(mesh.F(f, c), k)));
        append_bytes(out, std::uint16_t{0});
    }
    return out;
}

std::string glb_of(std::string json, const std::string& data) {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string out = "glTF";
    append_bytes(out, std::uint32_t{2});
    append_bytes(out, static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + data.size()));
    append_bytes(out, static_cast<std::uint32_t>(json.size()));
    out += "JSON" + json;
    append_bytes(out, static_cast<std::uint32_t>(data.size()));
    return out + std::string("BIN\0", 4) + data;
}

std::string glb_file(const TriMesh& mesh, const std::string& node) {
    Nodes y_up(mesh.X.rows(), 3);
    y_up << mesh.X.col(0), mesh.X.col(2), -mesh.X.col(1);
    std::string data;
    for (int v = 0; v < mesh.X.rows(); ++v)
        for (int k = 0; k < 3; ++k) append_bytes(data, static_cast<float>(y_up(v, k)));
    const std::size_t positions = data.size();
    for (int f = 0; f < mesh.F.rows(); ++f)
        for (int k = 0; k < 3; ++k) append_bytes(data, static_cast<std::uint32_t>(mesh.F(f, k)));
    std::ostringstream json;
    json << R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0)"
         << (node.empty() ? "" : ",") << node
         << R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{)"
         << R"("byteLength":)" << data.size()
         << R"(}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" << positions
         << R"(},{"buffer":0,"byteOffset":)" << positions << R"(,"byteLength":)" << data.size() - positions
         << R"(}],"accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":)" << mesh.X.rows()
         << R"(},{"bufferView":1,"componentType":5125,"type":"SCALAR","count":)" << 3 * mesh.F.rows()
         << "}]}";
    return glb_of(json.str(), data);
}

std::string reading_error(const std::filesystem::path& path) {
    return error_of([&] { read_surface(path); });
}

void expect_refused(const std::string& name, const Refusals& cases) {
    const TemporaryFolder folder;
    for (const auto& [content, text] : cases) {
        const std::string error = reading_error(folder.write(name, content));
        EXPECT_NE(error.find(text), std::string::npos) << "\"" << error << "\" without \"" << text << '"';
    }
}

Nodes corner_positions(const TriMesh& mesh) {
    Nodes X(mesh.F.size(), 3);
    for (int i = 0; i < mesh.F.size(); ++i) X.row(i) = mesh.X.row(mesh.F(i / 3, i % 3));
    return X;
}

}  // namespace nbd::test
