#include "tests/meshing/tet_file_writers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>

namespace nbd {
namespace {

template <class T>
void put(std::string& out, T value, bool big_endian) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (big_endian == (std::endian::native == std::endian::little)) std::reverse(raw, raw + sizeof(T));
    out.append(raw, sizeof(T));
}

/// Numbers as space-separated text or as raw bytes.
struct Numbers {
    std::string& out;
    bool binary = false, big_endian = false;
    void int32(std::int32_t v) { binary ? put(out, v, big_endian) : void(out += fmt::format("{} ", v)); }
    void int64(std::int64_t v) { binary ? put(out, v, big_endian) : void(out += fmt::format("{} ", v)); }
    void real64(double v) { binary ? put(out, v, big_endian) : void(out += fmt::format("{} ", v)); }
};

std::string gmsh_2(const TetMesh& tets, bool binary, bool big_endian) {
    std::string out = fmt::format("$MeshFormat\n2.2 {} 8\n", binary ? 1 : 0);
    Numbers numbers{out, binary, big_endian};
    if (binary) numbers.int32(1);
    out += "\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"all\"\n$EndPhysicalNames\n";
    out += fmt::format("$Nodes\n{}\n", tets.X.rows());
    for (int n = 0; n < tets.X.rows(); ++n) {
        numbers.int32(10 + 3 * n);
        for (int c = 0; c < 3; ++c) numbers.real64(tets.X(n, c));
    }
    out += fmt::format("\n$EndNodes\n$Elements\n{}\n", tets.T.rows() + 1);
    const auto header = [&](int type, int count, int tag) {
        if (binary) {
            numbers.int32(type), numbers.int32(count), numbers.int32(2);
        } else {
            numbers.int32(tag), numbers.int32(type), numbers.int32(2);
        }
    };
    header(2, 1, 1);
    if (binary) numbers.int32(1);
    for (const int v : {7, 7, 10, 13, 16}) numbers.int32(v);
    if (binary) header(4, tets.T.rows(), 0);
    for (int t = 0; t < tets.T.rows(); ++t) {
        if (binary) numbers.int32(t + 2);
        if (!binary) header(4, 1, t + 2);
        for (const int v : {7, 7}) numbers.int32(v);
        for (int c = 0; c < 4; ++c) numbers.int32(10 + 3 * tets.T(t, c));
    }
    return out + "\n$EndElements\n";
}

std::string gmsh_4(const TetMesh& tets, bool binary, bool big_endian) {
    std::string out = fmt::format("$MeshFormat\n4.1 {} 8\n", binary ? 1 : 0);
    Numbers numbers{out, binary, big_endian};
    if (binary) numbers.int32(1);
    out += "\n$EndMeshFormat\n$Nodes\n";
    const int n = tets.X.rows(), m = tets.T.rows(), first = n / 2;
    for (const int v : {2, n, 10, 10 + 3 * n}) numbers.int64(v);
    for (const auto& [begin, end] : {std::pair(0, first), std::pair(first, n)}) {
        for (const int v : {3, 1, 0}) numbers.int32(v);
        numbers.int64(end - begin);
        for (int i = begin; i < end; ++i) numbers.int64(10 + 3 * i);
        for (int i = begin; i < end; ++i)
            for (int c = 0; c < 3; ++c) numbers.real64(tets.X(i, c));
    }
    out += "\n$EndNodes\n$Elements\n";
    for (const int v : {2, m + 1, 1, m + 1}) numbers.int64(v);
    for (const int v : {2, 1, 2}) numbers.int32(v);
    for (const int v : {1, 1, 10, 13, 16}) numbers.int64(v);
    for (const int v : {3, 1, 4}) numbers.int32(v);
    numbers.int64(m);
    for (int t = 0; t < m; ++t) {
        numbers.int64(t + 2);
        for (int c = 0; c < 4; ++c) numbers.int64(10 + 3 * tets.T(t, c));
    }
    return out + "\n$EndElements\n";
}

std::string vtk(const TetMesh& tets, bool binary, bool version_5) {
    std::string out = fmt::format("# vtk DataFile Version {}\na test\n{}\nDATASET UNSTRUCTURED_GRID\n",
                                  version_5 ? "5.1" : "3.0", binary ? "BINARY" : "ASCII");
    Numbers numbers{out, binary, true};
    const auto n = tets.X.rows(), m = tets.T.rows();
    out += fmt::format("POINTS {} double\n", n);
    for (const double v : tets.X.reshaped<Eigen::RowMajor>()) numbers.real64(v);
    if (version_5) {
        out +=
            fmt::format("\nMETADATA\nINFORMATION 0\n\nCELLS {} {}\nOFFSETS vtktypeint64\n", m + 2, 4 * m + 3);
        numbers.int64(0);
        for (int t = 0; t <= m; ++t) numbers.int64(3 + 4 * t);
        out += "\nCONNECTIVITY vtktypeint64\n";
        for (const int v : {0, 1, 2}) numbers.int64(v);
        for (const int v : tets.T.reshaped<Eigen::RowMajor>()) numbers.int64(v);
    } else {
        out += fmt::format("\nCELLS {} {}\n", m + 1, 5 * m + 4);
        for (const int v : {3, 0, 1, 2}) numbers.int32(v);
        for (int t = 0; t < m; ++t) {
            numbers.int32(4);
            for (int c = 0; c < 4; ++c) numbers.int32(tets.T(t, c));
        }
    }
    out += fmt::format("\nCELL_TYPES {}\n", m + 1);
    numbers.int32(5);
    for (int t = 0; t < m; ++t) numbers.int32(10);
    return out + "\n";
}

}  // namespace

std::string gmsh_2_text(const TetMesh& tets) { return gmsh_2(tets, false, false); }
std::string gmsh_2_binary(const TetMesh& tets, bool big_endian) { return gmsh_2(tets, true, big_endian); }
std::string gmsh_4_text(const TetMesh& tets) { return gmsh_4(tets, false, false); }
std::string gmsh_4_binary(const TetMesh& tets, bool big_endian) { return gmsh_4(tets, true, big_endian); }
std::string vtk_text(const TetMesh& tets) { return vtk(tets, false, false); }
std::string vtk_binary(const TetMesh& tets) { return vtk(tets, true, false); }
std::string vtk_5_text(const TetMesh& tets) { return vtk(tets, false, true); }
std::string vtk_5_binary(const TetMesh& tets) { return vtk(tets, true, true); }

std::string medit_text(const TetMesh& tets) {
    std::string out =
        fmt::format("MeshVersionFormatted 2\n# a comment\nDimension\n3\nVertices\n{}\n", tets.X.rows());
    for (int n = 0; n < tets.X.rows(); ++n)
        out += fmt::format("{} {} {} 0\n", tets.X(n, 0), tets.X(n, 1), tets.X(n, 2));
    out += "Triangles\n1\n1 2 3 0\nCorners\n2\n1\n2\n";
    out += fmt::format("Tetrahedra\n{}\n", tets.T.rows());
    for (int t = 0; t < tets.T.rows(); ++t)
        out += fmt::format("{} {} {} {} 1\n", tets.T(t, 0) + 1, tets.T(t, 1) + 1, tets.T(t, 2) + 1,
                           tets.T(t, 3) + 1);
    return out + "End\n";
}

}  // namespace nbd
