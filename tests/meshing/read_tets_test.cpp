#include "meshing/formats/read_tets.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <map>
#include <random>
#include <utility>

#include "meshing/tets/tet_quality.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using test::replaced;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;

template <class T>
void put(std::string& out, T value, bool big_endian) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (big_endian == (std::endian::native == std::endian::little)) std::reverse(raw, raw + sizeof(T));
    out.append(raw, sizeof(T));
}

// The bytes of a tetrahedral mesh in each format that read_tets reads, following the specifications of the
// formats. The gmsh and VTK writers add one triangle (nodes 0 1 2), which the reader must leave out.

/// Numbers as space-separated text or as raw bytes.
struct Numbers {
    std::string& out;
    bool binary = false, big_endian = false;
    void int32(std::int32_t v) { binary ? put(out, v, big_endian) : void(out += fmt::format("{} ", v)); }
    void int64(std::int64_t v) { binary ? put(out, v, big_endian) : void(out += fmt::format("{} ", v)); }
    void real64(double v) { binary ? put(out, v, big_endian) : void(out += fmt::format("{} ", v)); }
};

enum class Form { text, little, big };

std::string gmsh_2(const TetMesh& tets, Form form = Form::text) {
    const bool binary = form != Form::text, big_endian = form == Form::big;
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

std::string gmsh_4(const TetMesh& tets, Form form = Form::text) {
    const bool binary = form != Form::text, big_endian = form == Form::big;
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

std::string vtk(const TetMesh& tets, Form form = Form::text, bool version_5 = false) {
    const bool binary = form != Form::text;
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

/// A cube of side 1.1, with coordinates that are not exact, cut into six tetrahedra around its diagonal.
TetMesh cube() {
    TetMesh tets;
    tets.X.resize(8, 3);
    for (int v = 0; v < 8; ++v) tets.X.row(v) << 1.1 * (v & 1), 1.1 * (v >> 1 & 1) + 1e-17, 1.1 * (v >> 2);
    tets.T.resize(6, 4);
    tets.T << 0, 1, 3, 7, 0, 3, 2, 7, 0, 2, 6, 7, 0, 6, 4, 7, 0, 4, 5, 7, 0, 5, 1, 7;
    return tets;
}

class ReadTets : public testing::Test {
 protected:
    std::filesystem::path write(const std::string& extension, const std::string& bytes) {
        return folder_.write("tets" + extension, bytes);
    }

    std::string error_of(const std::string& extension, const std::string& bytes) {
        const auto path = write(extension, bytes);
        return test::error_of([&] { read_tets(path); });
    }

    /// Contents of a file, and what read_tets() says of it, in part; after a text that ends in '$' no more.
    using Refusals = std::vector<std::pair<std::string, std::string>>;
    void expect_refused(const std::string& extension, const Refusals& cases) {
        for (const auto& [content, text] : cases)
            EXPECT_THAT(error_of(extension, content) + '$', HasSubstr(text)) << content;
    }

 private:
    test::TemporaryFolder folder_;
};

/// A small file in each format, by extension.
std::map<std::string, std::pair<std::string, std::string>> every_format(const TetMesh& tets) {
    return {{"gmsh 2 text", {".msh", gmsh_2(tets)}},
            {"gmsh 2 little", {".msh", gmsh_2(tets, Form::little)}},
            {"gmsh 2 big", {".msh", gmsh_2(tets, Form::big)}},
            {"gmsh 4 text", {".msh", gmsh_4(tets)}},
            {"gmsh 4 little", {".msh", gmsh_4(tets, Form::little)}},
            {"gmsh 4 big", {".msh", gmsh_4(tets, Form::big)}},
            {"medit", {".mesh", medit_text(tets)}},
            {"vtk text", {".vtk", vtk(tets)}},
            {"vtk binary", {".vtk", vtk(tets, Form::big)}},
            {"vtk 5 text", {".vtk", vtk(tets, Form::text, true)}},
            {"vtk 5 binary", {".VTK", vtk(tets, Form::big, true)}}};
}

TEST_F(ReadTets, ReadsTheSameBitsFromEveryFormat) {
    const TetMesh tets = cube();
    ASSERT_GT(tet_quality(tets).volume_min, 0);
    for (const auto& [name, file] : every_format(tets)) {
        std::vector<std::string> notes;
        const TetMesh read = read_tets(write(file.first, file.second), &notes);
        EXPECT_EQ(read.X, tets.X) << name;
        EXPECT_EQ(read.T, tets.T) << name;
        EXPECT_THAT(notes, ElementsAre("1 points, lines and surface cells left out")) << name;
    }
}

TEST_F(ReadTets, ReportsReorientedTetrahedraAndDroppedNodes) {
    TetMesh tets = cube(), loose = tets;
    loose.X.resize(10, 3);
    loose.X << tets.X.topRows(4), Eigen::MatrixXd::Constant(2, 3, std::nan("")), tets.X.bottomRows(4);
    for (int& node : loose.T.reshaped()) node += node < 4 ? 0 : 2;
    loose.T.row(2).head(2).reverseInPlace();
    std::vector<std::string> notes;
    const TetMesh read = read_tets(write(".mesh", medit_text(loose)), &notes);
    EXPECT_EQ(read.X, tets.X);
    EXPECT_NEAR(tet_quality(read).volume, 1.1 * 1.1 * 1.1, 1e-12);
    EXPECT_GT(tet_quality(read).volume_min, 0);
    EXPECT_THAT(notes, ElementsAre("1 points, lines and surface cells left out",
                                   "2 nodes without a tetrahedron dropped",
                                   "1 tetrahedra turned to positive volume"));
}

TEST_F(ReadTets, ReadsMeditWithoutEnd) {
    const TetMesh tets = cube();
    const std::string good = medit_text(tets);
    const std::string cut = good.substr(0, good.rfind("End"));
    EXPECT_EQ(read_tets(write(".mesh", cut)).T, tets.T);
    EXPECT_EQ(read_tets(write(".mesh", cut + "# made elsewhere")).T, tets.T);
    EXPECT_THAT(error_of(".mesh", cut.substr(0, cut.size() - 6)), HasSubstr("the file ends early"));
}

TEST_F(ReadTets, ReadsVtkWithFieldsBeforeThePoints) {
    const TetMesh tets = cube();
    const std::string fields =
        "FIELD FieldData 2\nTIME 1 1 double\n0.5\nMETADATA\nINFORMATION 0\n\nnames 2 3 int\n1 2 3 4 5 6\n";
    for (const std::string& good : {vtk(tets), vtk(tets, Form::text, true)}) {
        EXPECT_EQ(read_tets(write(".vtk", replaced(good, "POINTS", fields + "POINTS"))).X, tets.X);
        EXPECT_THAT(error_of(".vtk", replaced(good, "POINTS", "FIELD FieldData 1\na 1 1 string\nx\nPOINTS")),
                    HasSubstr("a field of type string before the points; allowed: numbers"));
        EXPECT_THAT(
            error_of(".vtk", replaced(good, "POINTS", "FIELD FieldData 1\na 99 99999999 double\n1\nPOINTS")),
            HasSubstr("rows, but the rest of the file holds at most"));
    }
    const std::string binary = "FIELD FieldData 1\nTIME 1 1 double\n" + std::string(8, '\0') + "\n";
    EXPECT_EQ(read_tets(write(".vtk", replaced(vtk(tets, Form::big), "POINTS", binary + "POINTS"))).X,
              tets.X);
}

TEST_F(ReadTets, RejectsInvalidGmshFiles) {
    const std::string good = gmsh_2(cube()), four = gmsh_4(cube());
    const Refusals cases = {
        {"", ".msh, line 1: the file ends early$"},
        {"solid cube\n", "line 1: expected $MeshFormat, found 'solid'$"},
        {replaced(good, "2.2", "4"), "line 2: version 4 is not supported; allowed: 2.x and 4.1$"},
        {replaced(good, "$Nodes\n8", "$Nodes\n80000000"),
         "claims 80000000 nodes, but the rest of the file holds at most"},
        {replaced(good, "$Nodes\n8", "$Nodes\n-8"), "claims -8 nodes"},
        {replaced(good, "13 1.1", "13 1,1"), "expected a number, found '1,1'"},
        {replaced(good, "13 1.1", "10 1.1"), "node 10 occurs twice"},
        {replaced(good, "4 2 7 7 10 13", "4 2 7 7 10 14"),
         "tetrahedron 0 refers to node 14, which is not in the file"},
        {replaced(good, "2 4 2 7 7 ", "2 5 2 7 7 "),
         "a volume element of type 5 with 8 nodes; only 4-node tetrahedra are allowed"},
        {replaced(good, "2 4 2 7 7 ", "2 77 2 7 7 "), "element type 77 is not known"},
        {replaced(four, "2 8 10", "2 9 10"), "announces 9 nodes, but holds 8"},
        {good.substr(0, good.find("$Elements")), "the file ends early, without $Elements"},
    };
    expect_refused(".msh", cases);
}

TEST_F(ReadTets, RejectsInvalidMeditFiles) {
    const std::string good = medit_text(cube());
    const Refusals cases = {
        {replaced(good, "Dimension\n3", "Dimension\n2"), "dimension is 2; allowed: 3"},
        {replaced(good, "1 2 4 8 1", "1 2 4 9 1"), "tetrahedron 0 refers to node 9; allowed: 1 to 8"},
        {replaced(good, "1 2 4 8 1", "0 2 4 8 1"), "tetrahedron 0 refers to node 0"},
        {replaced(good, "End", "Hexahedra\n1\n1 2 3 4 5 6 7 8 0\nEnd"),
         "holds Hexahedra; only 4-node tetrahedra are allowed"},
        {replaced(good, "End\n", "En"), "the file ends early, behind En"},
        {"MeshVersionFormatted 2\nDimension 3\nEnd\n", ": the file holds no tetrahedra$"},
    };
    expect_refused(".mesh", cases);
    EXPECT_EQ(error_of(".mesh", replaced(good, "End\n", "")), "");
}

TEST_F(ReadTets, RejectsInvalidVtkFiles) {
    const std::string good = vtk(cube());
    const Refusals cases = {
        {"<VTKFile type=\"UnstructuredGrid\">", "not a legacy VTK file"},
        {replaced(good, "UNSTRUCTURED_GRID", "POLYDATA"),
         "line 4: expected UNSTRUCTURED_GRID, found 'POLYDATA'"},
        {replaced(good, "double", "int"), "points must be float or double"},
        {replaced(good, "4 0 1 3 7", "4 0 1 3 8"), "cell 1 refers to point 8; allowed: 0 to 7"},
        {replaced(good, "5 10", "5 24"), "cell 1 is a volume of type 24"},
        {replaced(good, "5 10", "5 1"), "cell 1 of type 1 has 4 corners; allowed: 1"},
        {replaced(good, "CELL_TYPES 7", "CELL_TYPES 6"), "6 cell types for 7 cells"},
        {replaced(vtk(cube(), Form::text, true), "0 3 7", "0 9 7"), "OFFSETS must rise from 0 to 27"},
    };
    expect_refused(".vtk", cases);
}

TEST_F(ReadTets, RejectsInvalidGeometry) {
    TetMesh flat = cube();
    flat.X.row(3) = flat.X.row(1);
    EXPECT_THAT(error_of(".vtk", vtk(flat)), EndsWith(".vtk: tetrahedron 0 has no volume"));
    TetMesh wild = cube();
    wild.X(6, 0) = std::nan("");
    EXPECT_THAT(error_of(".vtk", vtk(wild, Form::big)),
                EndsWith(": tetrahedron 2 has a corner that is not finite"));
    TetMesh twice = cube();
    twice.T.row(5) = twice.T.row(0);
    EXPECT_THAT(error_of(".msh", gmsh_4(twice)),
                EndsWith(": tetrahedra 0 and 5 overlap: they lie on the same side of their shared face"));
    EXPECT_THAT(error_of(".obj", ""),
                EndsWith("tetrahedra are read from .msh, .mesh, .vtk, .vtu and .inp, not from '.obj'"));
    EXPECT_THROW(read_tets("/no/such/file.msh"), std::runtime_error);
}

TEST_F(ReadTets, RejectsTruncatedFiles) {
    const TetMesh tets = cube();
    for (const auto& [name, file] : every_format(tets)) {
        const auto& [extension, bytes] = file;
        // Medit files are whole without their last word.
        const std::size_t whole =
            name == "medit" ? bytes.rfind("End") - 1 : bytes.find_last_not_of(" \n") + 1;
        for (std::size_t size = 0; size < whole; size += size + 17 < whole ? 17 : 1)
            EXPECT_NE(error_of(extension, bytes.substr(0, size)), "") << name << " cut to " << size;
    }
}

TEST_F(ReadTets, NeverCrashesOnDamage) {
    const TetMesh tets = cube();
    std::mt19937 random(7);
    int refused = 0, accepted = 0;
    for (const auto& [name, file] : every_format(tets))
        for (int i = 0; i < 30; ++i) {
            std::string bytes = file.second;
            for (int k = 0; k < 3; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
            const std::string error = error_of(file.first, bytes);
            error == "" ? ++accepted : ++refused;
            EXPECT_EQ(error.find('\n'), error.npos);
        }
    EXPECT_GT(refused, 50);
    EXPECT_GT(accepted, 10);
}

}  // namespace
}  // namespace nbd
