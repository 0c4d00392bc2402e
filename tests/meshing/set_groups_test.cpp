// Groups of cell data of VTK, and of sets and surfaces of CalculiX.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "meshing/formats/read_tets.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using test::error_of;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::UnorderedElementsAre;

struct ReadGroups {
    std::vector<std::pair<std::string, std::vector<int>>> tets;
    std::vector<std::pair<std::string, std::array<int, 3>>> faces;  // by sorted corners
    std::vector<std::string> notes;
};

/// Two tetrahedra that share the face of nodes 1, 2 and 3.
class SetGroups : public ::testing::Test {
 protected:
    ReadGroups read(const std::string& name, const std::string& text) const {
        ReadGroups found;
        std::vector<TetGroup> groups;
        std::vector<FaceGroup> face_groups;
        const TetMesh mesh = read_tets(folder_.write(name, text), &found.notes, &groups, &face_groups);
        EXPECT_EQ(mesh.T.rows(), 2);
        const Faces boundary = boundary_faces(mesh);
        for (const TetGroup& group : groups) found.tets.emplace_back(group.name, group.tets);
        for (const FaceGroup& group : face_groups)
            for (const int face : group.faces)
                found.faces.emplace_back(group.name, sorted_corners(boundary, face));
        return found;
    }
    std::string refusal(const std::string& name, const std::string& text) const {
        const std::string line = error_of<std::runtime_error>([&] { read_tets(folder_.write(name, text)); });
        EXPECT_EQ(line.find('\n'), std::string::npos);
        return line;
    }

 private:
    test::TemporaryFolder folder_;
};

const std::string vtk_head =
    "# vtk DataFile Version 3.0\nbar\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n0 0 0\n1 0 0\n0 1 0\n"
    "0 0 1\n1 1 1\nCELLS 4 18\n4 0 1 2 3\n3 0 1 2\n4 1 4 2 3\n3 1 2 4\nCELL_TYPES 4\n10\n5\n10\n5\n";

TEST_F(SetGroups, OfLegacyVtkAreNumbersOfCells) {
    const std::string other = "CELL_DATA 4\nSCALARS stress double 1\nLOOKUP_TABLE default\n1 2 3 nan\n",
                      points = "POINT_DATA 5\nVECTORS u float\n0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n",
                      numbers = "7 3 0 3\n";
    for (const std::string& data :
         {other + "SCALARS Region int\nLOOKUP_TABLE default\n" + numbers + points,
          other + "FIELD FieldData 2\nother 2 4 int\n1 1 1 1 1 1 1 1\nmedit:ref 1 4 vtktypeint64\n" + numbers,
          points + other + "SCALARS CellEntityIds int 1\nLOOKUP_TABLE default\n" + numbers,
          other + "SCALARS material int 1\nLOOKUP_TABLE default\n" + numbers +
              "SCALARS group int 1\nLOOKUP_TABLE default\n1 1 1 1\n"}) {
        SCOPED_TRACE(data);
        const ReadGroups groups = read("a.vtk", vtk_head + data);
        EXPECT_THAT(groups.tets, ElementsAre(Pair("group 7", ElementsAre(0))));
        EXPECT_THAT(groups.faces, UnorderedElementsAre(Pair("group 3", ElementsAre(0, 1, 2)),
                                                       Pair("group 3", ElementsAre(1, 2, 4))));
    }
    for (const std::string data : {"SCALARS region float 1\nLOOKUP_TABLE default\n1 2 3 4\n",
                                   "SCALARS numbers int 1\nLOOKUP_TABLE default\n1 2 3 4\n"}) {
        const ReadGroups none = read("a.vtk", vtk_head + "CELL_DATA 4\n" + data);
        EXPECT_THAT(none.tets, IsEmpty()) << data;
        EXPECT_THAT(none.faces, IsEmpty()) << data;
    }
    EXPECT_THAT(read("a.vtk", vtk_head + "CELL_DATA 4").tets, IsEmpty());
    EXPECT_THAT(
        refusal("a.vtk", vtk_head + "CELL_DATA 4\nSCALARS region int\nLOOKUP_TABLE default\n1 2 x 4\n"),
        HasSubstr("a.vtk, line 24: "));
    EXPECT_THAT(refusal("a.vtk", vtk_head + "CELL_DATA 4\nSCALARS region int\nLOOKUP_TABLE default\n1 2\n"),
                HasSubstr("the file ends early"));
    EXPECT_THAT(
        refusal("a.vtk", vtk_head + "CELL_DATA 4\nFIELD f 1\ngroup 1 4 vtktypeint64\n1 2 99999999999 4\n"),
        HasSubstr("cell 2 is of group 99999999999; allowed: -2147483647 to 2147483647"));
}

TEST_F(SetGroups, OfBinaryVtkAreNumbersOfCells) {
    std::string text = "# vtk DataFile Version 3.0\nbar\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n";
    const auto add = [&](std::uint32_t value, int bytes) {
        while (bytes-- > 0) text += static_cast<char>(value >> (8 * bytes) & 255);
    };
    for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 1.f, 1.f, 1.f})
        add(x == 1.f ? 0x3f800000u : 0u, 4);
    text += "\nCELLS 2 10\n";
    for (const int corner : {4, 0, 1, 2, 3, 4, 1, 4, 2, 3}) add(corner, 4);
    text += "\nCELL_TYPES 2\n";
    for (int c = 0; c < 2; ++c) add(10, 4);
    text += "\nCELL_DATA 2\nSCALARS stress double 1\nLOOKUP_TABLE default\n" + std::string(16, '\n') +
            "\nFIELD FieldData 2\nother 3 2 float\n" + std::string(24, ' ') + "\ngroup 1 2 short\n";
    add(0xfffe, 2);
    add(5, 2);
    const ReadGroups groups = read("a.vtk", text + "\n");
    EXPECT_THAT(groups.tets, ElementsAre(Pair("group 2", ElementsAre(0)), Pair("group 5", ElementsAre(1))));
}

TEST_F(SetGroups, OfVtuAreNumbersOfCells) {
    const auto vtu = [](const std::string& data) {
        return "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"5\" NumberOfCells=\"3\">"
               "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">"
               "0 0 0 1 0 0 0 1 0 0 0 1 1 1 1</DataArray></Points><Cells>"
               "<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3 0 1 2 1 4 2 3</DataArray>"
               "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4 7 11</DataArray>"
               "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10 5 10</DataArray></Cells>"
               "<CellData>" +
               data + "</CellData></Piece></UnstructuredGrid></VTKFile>";
    };
    const ReadGroups groups = read(
        "a.vtu", vtu("<DataArray type=\"Float64\" Name=\"region\" format=\"ascii\">1 2 3</DataArray>"
                     "<DataArray type=\"Int32\" Name=\"gmsh:physical\" format=\"ascii\">4 9 8</DataArray>"));
    EXPECT_THAT(groups.tets, ElementsAre(Pair("group 4", ElementsAre(0)), Pair("group 8", ElementsAre(1))));
    EXPECT_THAT(groups.faces, ElementsAre(Pair("group 9", ElementsAre(0, 1, 2))));
    EXPECT_THAT(read("a.vtu", vtu("<DataArray type=\"Int32\" Name=\"group\" NumberOfComponents=\"2\" "
                                  "format=\"ascii\">1 2 3 4 5 6</DataArray>"))
                    .tets,
                IsEmpty());
    EXPECT_THAT(
        refusal("a.vtu", vtu("<DataArray type=\"Int32\" Name=\"group\" format=\"ascii\">1 2</DataArray>")),
        HasSubstr("groups hold 2 numbers; allowed: 3"));
}

const std::string inp_nodes =
    "** made by hand\n*Heading\n a bar\n*NODE, NSET=Nall\n 10, 0., 0., 0.\n11, 1.0D+00, 0, 0\n12, 0, 1\n"
    "13, 0, 0, 1\n14, 1, 1, 1\n99, 5, 5, 5\n";
const std::string inp_elements = "*Element, type=C3D4, elset=Eall\n 1, 10, 11, 12, 13\n2, 11, 14,\n 12, 13\n";

TEST_F(SetGroups, OfCalculixAreItsSetsAndSurfaces) {
    const ReadGroups groups =
        read("bar.inp", inp_nodes + inp_elements +
                            "*ELEMENT, TYPE=S3, ELSET=skin\n7, 10, 11, 12\n"
                            "*ELSET, ELSET=tip\n2,\n"
                            "*NSET, NSET=base\n10, 11, 13\n*NSET,NSET=one\n10\n"
                            "*NSET, NSET=both, GENERATE\n10, 13, 1\n"
                            "*NSET, NSET=again\nBASE\n"
                            "*SURFACE, NAME=load, TYPE=ELEMENT\ntip, S2\n1, S4\n"
                            "*MATERIAL, NAME=steel\n*ELASTIC\n 2e11, 0.3\n*STEP\n*END STEP\n");
    EXPECT_THAT(groups.tets, ElementsAre(Pair("tip", ElementsAre(1))));
    // Nodes 10 to 14 are 0 to 4. Side 2 of element 2 (11 14 12 13) has its nodes 1, 4 and 2: 11, 13, 14. Side
    // 4 of element 1 has its nodes 3, 4 and 1: 12, 13, 10.
    EXPECT_THAT(groups.faces,
                UnorderedElementsAre(Pair("skin", ElementsAre(0, 1, 2)), Pair("base", ElementsAre(0, 1, 3)),
                                     Pair("again", ElementsAre(0, 1, 3)), Pair("both", ElementsAre(0, 1, 2)),
                                     Pair("both", ElementsAre(0, 1, 3)), Pair("both", ElementsAre(0, 2, 3)),
                                     Pair("load", ElementsAre(1, 3, 4)), Pair("load", ElementsAre(0, 2, 3))));
    EXPECT_THAT(
        groups.notes,
        ElementsAre("1 points, lines and surface cells left out", "1 nodes without a tetrahedron dropped",
                    "set one of 1 nodes left out: no face has all of its corners in it"));
}

TEST_F(SetGroups, OfATetrahedronInSeveralSetsAreTheFirst) {
    const ReadGroups groups = read("bar.inp", inp_nodes +
                                                  "*ELEMENT, TYPE=C3D4, ELSET=left\n1, 10, 11, 12, 13\n"
                                                  "*ELEMENT, TYPE=C3D4, ELSET=right\n2, 11, 14, 12, 13\n"
                                                  "*ELSET, ELSET=soft\nRight\n");
    EXPECT_THAT(groups.tets, ElementsAre(Pair("left", ElementsAre(0)), Pair("right", ElementsAre(1))));
    EXPECT_THAT(groups.notes,
                testing::Contains("1 of 1 tetrahedra of set soft are in an earlier set, for which "
                                  "they count"));
}

TEST_F(SetGroups, OfCalculixAreRefusedWhereTheyAreWrong) {
    const auto wrong = [&](const std::string& more) {
        return refusal("bar.inp", inp_nodes + inp_elements + more);
    };
    EXPECT_THAT(wrong("*ELSET, ELSET=a\n5\n"), HasSubstr("element 5 is not in the file"));
    EXPECT_THAT(wrong("*NSET, NSET=a\nb\n"), HasSubstr("'b' is neither a node nor a set of them"));
    EXPECT_THAT(wrong("*NSET\n10\n"), HasSubstr("*NSET has no NSET="));
    EXPECT_THAT(wrong("*NSET, NSET=a, GENERATE\n-9223372036854775808, 5, 7\n"),
                HasSubstr("GENERATE goes from -9223372036854775808 to 5; allowed: upwards from 0 or more"));
    EXPECT_THAT(wrong("*NSET, NSET=a, GENERATE\n1, 9, 0\n"),
                HasSubstr("the step of GENERATE is 0; allowed: at least 1"));
    EXPECT_THAT(wrong("*SURFACE, NAME=a\n1, S5\n"),
                HasSubstr("'S5' is no side of a tetrahedron; allowed: S1 to S4"));
    EXPECT_THAT(wrong("*ELEMENT, TYPE=C3D10\n3, 10, 11\n"),
                HasSubstr("elements are of type C3D10; only 4-node tetrahedra"));
    EXPECT_THAT(wrong("*ELEMENT, TYPE=C3D4\n1, 10, 11, 12, 13\n"), HasSubstr("element 1 is there twice"));
    EXPECT_THAT(wrong("*ELEMENT, TYPE=C3D4\n3, 10, 11, 12\n"),
                HasSubstr("element 3 has 3 nodes; allowed: 4"));
    EXPECT_THAT(wrong("*ELEMENT, TYPE=C3D4\n3, 10, 11, 12, 77\n"), HasSubstr("node 77 is not in the file"));
    EXPECT_THAT(wrong("*NODE\n10, 0, 0, 0\n"), HasSubstr("node 10 is there twice"));
    EXPECT_THAT(wrong("*NODE\n20, 0, zero, 0\n"), HasSubstr("'zero' is no coordinate"));
    EXPECT_THAT(wrong("*INCLUDE, INPUT=b.inp\n"), HasSubstr("*INCLUDE is not followed"));
    EXPECT_THAT(refusal("bar.inp", "hello\n"), HasSubstr("it does not begin with a keyword such as *NODE"));
    EXPECT_THAT(refusal("bar.inp", inp_nodes), HasSubstr("the file holds no tetrahedra"));
    EXPECT_THAT(refusal("bar.inp", ""), HasSubstr("the file has no *NODE"));
}

}  // namespace
}  // namespace nbd
