#include "meshing/formats/read_tets.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <utility>

#include "meshing/tets/tet_quality.hpp"
#include "tests/meshing/tet_file_writers.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;

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

 private:
    test::TemporaryFolder folder_;
};

/// A small file in each format, by extension.
std::map<std::string, std::pair<std::string, std::string>> every_format(const TetMesh& tets) {
    return {{"gmsh 2 text", {".msh", gmsh_2_text(tets)}},
            {"gmsh 2 little", {".msh", gmsh_2_binary(tets, false)}},
            {"gmsh 2 big", {".msh", gmsh_2_binary(tets, true)}},
            {"gmsh 4 text", {".msh", gmsh_4_text(tets)}},
            {"gmsh 4 little", {".msh", gmsh_4_binary(tets, false)}},
            {"gmsh 4 big", {".msh", gmsh_4_binary(tets, true)}},
            {"medit", {".mesh", medit_text(tets)}},
            {"vtk text", {".vtk", vtk_text(tets)}},
            {"vtk binary", {".vtk", vtk_binary(tets)}},
            {"vtk 5 text", {".vtk", vtk_5_text(tets)}},
            {"vtk 5 binary", {".VTK", vtk_5_binary(tets)}}};
}

/// `text` with the first occurrence of `from` replaced; fails if there is none.
std::string with(std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    EXPECT_NE(at, text.npos) << from;
    return text.replace(at, from.size(), to);
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
    for (const std::string& good : {vtk_text(tets), vtk_5_text(tets)}) {
        EXPECT_EQ(read_tets(write(".vtk", with(good, "POINTS", fields + "POINTS"))).X, tets.X);
        EXPECT_THAT(error_of(".vtk", with(good, "POINTS", "FIELD FieldData 1\na 1 1 string\nx\nPOINTS")),
                    HasSubstr("a field of type string before the points; allowed: numbers"));
        EXPECT_THAT(
            error_of(".vtk", with(good, "POINTS", "FIELD FieldData 1\na 99 99999999 double\n1\nPOINTS")),
            HasSubstr("rows, but the rest of the file holds at most"));
    }
    const std::string binary = "FIELD FieldData 1\nTIME 1 1 double\n" + std::string(8, '\0') + "\n";
    EXPECT_EQ(read_tets(write(".vtk", with(vtk_binary(tets), "POINTS", binary + "POINTS"))).X, tets.X);
}

TEST_F(ReadTets, RejectsInvalidGmshFiles) {
    const std::string good = gmsh_2_text(cube()), four = gmsh_4_text(cube());
    EXPECT_THAT(error_of(".msh", ""), EndsWith(".msh, line 1: the file ends early"));
    EXPECT_THAT(error_of(".msh", "solid cube\n"), EndsWith("line 1: expected $MeshFormat, found 'solid'"));
    EXPECT_THAT(error_of(".msh", with(good, "2.2", "4")),
                EndsWith("line 2: version 4 is not supported; allowed: 2.x and 4.1"));
    EXPECT_THAT(error_of(".msh", with(good, "$Nodes\n8", "$Nodes\n80000000")),
                HasSubstr("claims 80000000 nodes, but the rest of the file holds at most"));
    EXPECT_THAT(error_of(".msh", with(good, "$Nodes\n8", "$Nodes\n-8")), HasSubstr("claims -8 nodes"));
    EXPECT_THAT(error_of(".msh", with(good, "13 1.1", "13 1,1")),
                HasSubstr("expected a number, found '1,1'"));
    EXPECT_THAT(error_of(".msh", with(good, "13 1.1", "10 1.1")), HasSubstr("node 10 occurs twice"));
    EXPECT_THAT(error_of(".msh", with(good, "4 2 7 7 10 13", "4 2 7 7 10 14")),
                HasSubstr("tetrahedron 0 refers to node 14, which is not in the file"));
    EXPECT_THAT(error_of(".msh", with(good, "2 4 2 7 7 ", "2 5 2 7 7 ")),
                HasSubstr("a volume element of type 5 with 8 nodes; only 4-node tetrahedra are allowed"));
    EXPECT_THAT(error_of(".msh", with(good, "2 4 2 7 7 ", "2 77 2 7 7 ")),
                HasSubstr("element type 77 is not known"));
    EXPECT_THAT(error_of(".msh", with(four, "2 8 10", "2 9 10")),
                HasSubstr("announces 9 nodes, but holds 8"));
    EXPECT_THAT(error_of(".msh", good.substr(0, good.find("$Elements"))),
                HasSubstr("the file ends early, without $Elements"));
}

TEST_F(ReadTets, RejectsInvalidMeditFiles) {
    const std::string good = medit_text(cube());
    EXPECT_THAT(error_of(".mesh", with(good, "Dimension\n3", "Dimension\n2")),
                HasSubstr("dimension is 2; allowed: 3"));
    EXPECT_THAT(error_of(".mesh", with(good, "1 2 4 8 1", "1 2 4 9 1")),
                HasSubstr("tetrahedron 0 refers to node 9; allowed: 1 to 8"));
    EXPECT_THAT(error_of(".mesh", with(good, "1 2 4 8 1", "0 2 4 8 1")),
                HasSubstr("tetrahedron 0 refers to node 0"));
    EXPECT_THAT(error_of(".mesh", with(good, "End", "Hexahedra\n1\n1 2 3 4 5 6 7 8 0\nEnd")),
                HasSubstr("holds Hexahedra; only 4-node tetrahedra are allowed"));
    EXPECT_EQ(error_of(".mesh", with(good, "End\n", "")), "");
    EXPECT_THAT(error_of(".mesh", with(good, "End\n", "En")), HasSubstr("the file ends early, behind En"));
    EXPECT_THAT(error_of(".mesh", "MeshVersionFormatted 2\nDimension 3\nEnd\n"),
                EndsWith(": the file holds no tetrahedra"));
}

TEST_F(ReadTets, RejectsInvalidVtkFiles) {
    const std::string good = vtk_text(cube());
    EXPECT_THAT(error_of(".vtk", "<VTKFile type=\"UnstructuredGrid\">"), HasSubstr("not a legacy VTK file"));
    EXPECT_THAT(error_of(".vtk", with(good, "UNSTRUCTURED_GRID", "POLYDATA")),
                HasSubstr("line 4: expected UNSTRUCTURED_GRID, found 'POLYDATA'"));
    EXPECT_THAT(error_of(".vtk", with(good, "double", "int")), HasSubstr("points must be float or double"));
    EXPECT_THAT(error_of(".vtk", with(good, "4 0 1 3 7", "4 0 1 3 8")),
                HasSubstr("cell 1 refers to point 8; allowed: 0 to 7"));
    EXPECT_THAT(error_of(".vtk", with(good, "5 10", "5 24")), HasSubstr("cell 1 is a volume of type 24"));
    EXPECT_THAT(error_of(".vtk", with(good, "5 10", "5 1")),
                HasSubstr("cell 1 of type 1 has 4 corners; allowed: 1"));
    EXPECT_THAT(error_of(".vtk", with(good, "CELL_TYPES 7", "CELL_TYPES 6")),
                HasSubstr("6 cell types for 7 cells"));
    EXPECT_THAT(error_of(".vtk", with(vtk_5_text(cube()), "0 3 7", "0 9 7")),
                HasSubstr("OFFSETS must rise from 0 to 27"));
}

TEST_F(ReadTets, RejectsInvalidGeometry) {
    TetMesh flat = cube();
    flat.X.row(3) = flat.X.row(1);
    EXPECT_THAT(error_of(".vtk", vtk_text(flat)), EndsWith(".vtk: tetrahedron 0 has no volume"));
    TetMesh wild = cube();
    wild.X(6, 0) = std::nan("");
    EXPECT_THAT(error_of(".vtk", vtk_binary(wild)),
                EndsWith(": tetrahedron 2 has a corner that is not finite"));
    TetMesh twice = cube();
    twice.T.row(5) = twice.T.row(0);
    EXPECT_THAT(error_of(".msh", gmsh_4_text(twice)),
                EndsWith(": tetrahedra 0 and 5 overlap: they lie on the same side of their shared face"));
    EXPECT_THAT(error_of(".obj", ""),
                EndsWith("tetrahedra are read from .msh, .mesh, .vtk and .vtu, not from '.obj'"));
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
