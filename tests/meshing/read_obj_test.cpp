#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "meshing/formats/read_surface.hpp"
#include "meshing/formats/surface_formats.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using namespace test;

const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

std::string refusal(const std::string& content) {
    const test::TemporaryFolder folder;
    const auto path = folder.write("a.obj", content);
    return test::error_of<std::runtime_error>([&] { read_obj(path); });
}

TEST(ReadObj, AcceptsWhatTheFormatAllows) {
    const std::vector<std::string> good = {
        triangle + "f 1 2 3\n",
        "# all kinds\r\nv 0 0 0 1\r\nv 1 0 0 .5 0.5 1e-3\r\nv +0 1. -1E+2 # end\r\nvn 0 0\r\nvt 1\r\nf 1/7/7 "
        "2// -1/x\r\n",
        "f 1 2 3\n" + triangle,                                    // the face comes first
        "v 0 0 \\\n0\nv 1 0 0\nv 0 1 0\nf 1 2 \\\n3\n",            // lines that go on
        triangle + "# C:\\models\\\nf 1 2 9\nf 1 2 3\n",           // a comment that goes on
        "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r",                    // carriage returns alone
        "v 0,5 0 0\nv 1 0 nan\nv 0 1e999 0\nf 1 2 3\nfoo x\nvp\n"  // a decimal comma; what is not finite
                                                                   // comes later
    };
    for (const std::string& content : good) EXPECT_EQ(refusal(content), "") << content;
}

TEST(ReadObj, ReadsGroupsObjectsAndMaterialsAsGroupsOfFaces) {
    const test::TemporaryFolder folder;
    const auto path = folder.write(
        "a.obj", "o whole\n" + triangle +
                     "v 1 1 0\nv 2 2 2\ng base side\nf 1 2 3\nusemtl  soft rubber \r\nf 1 2 4 3\n"
                     "g side\nf 2 3 4\ng\nusemtl steel\nf 1 2 5\ngroup x\nusemtlx y\n");
    std::vector<FaceGroup> groups;
    const TriMesh mesh = read_surface(path, &groups);
    ASSERT_EQ(mesh.F.rows(), 5);  // of faces 0, 1, 1, 2 and 3
    EXPECT_EQ(groups,
              (std::vector<FaceGroup>{
                  {"base", {0, 1, 2}}, {"side", {0, 1, 2, 3}}, {"soft rubber", {1, 2, 3}}, {"steel", {4}}}));
    read_surface(folder.write("b.obj", triangle + "g one\nf 1 2 3\n"), &groups);
    EXPECT_TRUE(groups.empty());
}

TEST(ReadObj, NamesTheLineOfWhatIsWrong) {
    const std::vector<std::pair<std::string, std::string>> cases = {
        {"v 0 0\n", "line 1: the vertex has 2 numbers; allowed: 3, 4 with a weight, or 6 with a colour"},
        {"# five\n\nv 0 0 0 0 0\n",
         "line 3: the vertex has 5 numbers; allowed: 3, 4 with a weight, or 6 with a colour"},
        {"v 0 \n", "line 1: the vertex has 1 number; allowed: 3, 4 with a weight, or 6 with a colour"},
        {triangle + "v 0 1x 0\n", "line 4: the vertex has '1x'; allowed: numbers"},
        {triangle + "v 0 0 0,,5\n", "line 4: the vertex has '0,,5'; allowed: numbers"},
        {triangle + "f 1 2 4\n", "line 4: the face refers to vertex 4, but the file has 3 vertices"},
        {"f 1 2 4\n" + triangle, "line 1: the face refers to vertex 4, but the file has 3 vertices"},
        {triangle + "f 1 2 -4\n", "line 4: the face refers to vertex -4, but 3 vertices come before it"},
        {triangle + "f 1 2 0/1\n",
         "line 4: the face refers to vertex 0; allowed: from 1 on, or from -1 back"},
        {triangle + "f 1 2 c\n", "line 4: the face has 'c'; allowed: corners such as 3, 3/1 or 3/1/2"},
        {"v 0 0 0\rv 1 0 0\rv 0 1 0\r\rf 1 2 4\r",
         "line 5: the face refers to vertex 4, but the file has 3 vertices"},
        {"# one \\\nv 0 0 0\n" + triangle + "f 1 2 4\n",
         "line 6: the face refers to vertex 4, but the file has 3 vertices"},
        {triangle + "f 1 2 99999999999999999999\n",
         "line 4: the face has '99999999999999999999'; allowed: corners such as 3, 3/1 or 3/1/2"}};
    for (const auto& [content, error] : cases) EXPECT_EQ(refusal(content), error) << content;
}

TEST(ReadSurface, ReportsErrorsInOffFiles) {
    const Refusals cases = {
        {"3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "does not start with \"OFF\""},
        {"4OFF\n3 1 0\n", "\"4OFF\" is not three-dimensional"},
        {"OFF\n# nothing else\n", "line 3: the file ends early"},
        {"OFF BINARY\n", "line 1: expected an integer, found 'BINARY'"},
        {"OFF\n3 999999999 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
         "claims 999999999 faces, but the rest of the file holds at most"},
        {"OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n", "ends early, before vertex 3 of 4"},
        {"OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n", "vertex 1 of 3 ends early"},
        {"OFF\n3 1 0\n0 0 0\n1x 0 0\n0 1 0\n3 0 1 2\n", "line 4: expected a number, found '1x'"},
        {"OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n1e999 0 0\n3 0 1 2\n",
         "line 6: '1e999' is too large"},  // no corner
        {"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n9 0 1 2\n",
         "claims 9 corners, but the rest of the file holds at most"},
        {"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n",
         "face 0 refers to vertex 7, but the file has 3 vertices"},
        {"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", "face 0 refers to vertex -1"},
        {"OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "no faces in the file"}};
    expect_refused("a.off", cases);
}

TEST(ReadSurface, ReadsOffFacesThatGoOnInTheNextLine) {
    const TemporaryFolder folder;
    const TriMesh read = read_surface(folder.write("a.off",
                                                   "OFF\n5\n2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n"
                                                   "4 0 1 # two more\n\n2\n3 255 0 0\n3\n0 1 4 7\n"));
    EXPECT_EQ(read.F.rows(), 3);
    EXPECT_EQ(read.F.row(2), Eigen::RowVector3i(0, 1, 4));
}

TEST(ReadSurface, IgnoresColoursAndCommentsOfOffFiles) {
    const TemporaryFolder folder;
    const TriMesh read = read_surface(
        folder.write("a.off",
                     "COFF # kind\r\n\r\n# counts\r\n3 2 0\r\n0 0 0 255 0 0 255\r\n"
                     "+1 0 0 0 0 0 0\r\n0 1 0 1 1 1 1 # last\r\n2 0 1\r\n3 0 1 2 0.5 0.5 0.5\r\n"));
    EXPECT_EQ(read.F, (Faces(1, 3) << 0, 1, 2).finished());
    EXPECT_EQ(read.X.rows(), 3);
}

TEST(ReadSurface, ReportsErrorsInPlyFiles) {
    const auto with = [good = ascii_ply_file(tetrahedron())](const std::string& from, const std::string& to) {
        return replaced(good, from, to);
    };
    const Refusals cases = {
        {with("ascii", "ebcdic"), "unknown format \"ebcdic\""},
        {with("format ascii 1.0\n", ""), "no \"format\" line"},
        {with("float x", "floot x"), "unknown type \"floot\""},
        {with("property float z\n", ""), "no vertex property \"z\""},
        {with("vertex_indices", "corners"), "no face property \"vertex_indices\""},
        {with("end_header\n", ""), "unknown keyword"},
        {with("element vertex 4\n", ""), "a property comes before the first element"},
        {with("face 4", "face 5"), "line 19: the file ends early, in face 4 of 5"},
        {with("face 4", "face 0"), "no faces in the file"},
        {with("3 0", "3 9"), "face 0 refers to vertex 9, but the file has 4 vertices"},
        {with("3 0", "3 -1"), "face 0 refers to vertex -1, but the file has 4 vertices"},
        {with("3 0", "-3 0"), "face 0 has a list of -3 entries"},
        {with("3 0", "3 0.5"), "face 0 refers to vertex 0.5"},
        {with("1 0 0", "nan 0 0"), "vertex 1 is not finite: (nan, 0, 0)"},
        {with("1 0 0", "1e99 0 0"), "vertex 1 is too far away: (1e+99, 0, 0); allowed: up to 3.4e+38 m"}};
    expect_refused("a.ply", cases);
}

/// A .ply file of five vertices and the given strips, one list a line.
std::string ply_of_strips(const std::string& strips, int count) {
    return "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
           "element tristrips " +
           std::to_string(count) +
           "\nproperty list int int vertex_indices\nend_header\n"
           "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 1\n" +
           strips;
}

Faces faces(std::initializer_list<std::array<int, 3>> rows) {
    Faces F(rows.size(), 3);
    Eigen::Index f = 0;
    for (const auto& [a, b, c] : rows) F.row(f++) << a, b, c;
    return F;
}

TEST(ReadSurface, ReadsPlyStrips) {
    const TemporaryFolder folder;
    const auto read = [&](const std::string& strips, int count) {
        return read_surface(folder.write("a.ply", ply_of_strips(strips, count))).F;
    };
    const Faces expected = faces({{0, 1, 2}, {2, 1, 3}, {2, 3, 4}});
    EXPECT_EQ(read("5 0 1 2 3 4\n", 1), expected) << "every second triangle is turned";
    EXPECT_EQ(read("9 0 1 2 3 -1 2 3 4 -1\n", 1), expected) << "-1 starts anew";
    EXPECT_EQ(read("4 0 1 2 3\n3 2 3 4\n", 2), expected) << "so does each list";
    // 0 1 2, then the joints 1 2 2, 2 2 3 and 2 3 3, which are skipped, then 3 3 4 and 3 4 1.
    EXPECT_EQ(read("8 0 1 2 2 3 3 4 1\n", 1), faces({{0, 1, 2}, {4, 3, 1}}));
}

TEST(ReadSurface, ReportsErrorsInPlyStrips) {
    expect_refused(
        "a.ply", {{ply_of_strips("3 0 1 5\n", 1), "face 0 refers to vertex 5, but the file has 5 vertices"},
                  {ply_of_strips("3 0 1 -2\n", 1), "face 0 refers to vertex -2, but the file has 5 vertices"},
                  {ply_of_strips("3 0 1 1.5\n", 1), "strip 0 refers to vertex 1.5"},
                  {ply_of_strips("4 0 1 2\n", 1), "line 16: the file ends early"},
                  {ply_of_strips("2 0 1\n", 1), "no faces in the file"}});
}

TEST(ReadSurface, IgnoresOtherElementsAndPropertiesOfPlyFiles) {
    const TemporaryFolder folder;
    const TriMesh read = read_surface(folder.write(
        "a.ply",
        "ply\r\nformat ascii 1.0\r\nobj_info x\r\nelement camera 2\r\nproperty float f\r\n"
        "property list int float g\r\nelement vertex 3\r\nproperty uchar red\r\nproperty double x\r\n"
        "property double y\r\nproperty double z\r\nelement face 1\r\nproperty uchar flags\r\n"
        "property list uchar uint vertex_index\r\nproperty list uchar float texcoord\r\n"
        "end_header\r\n1 2 5 6\r\n1 0\r\n255 0 0 0\r\n0 +1 0 0\r\n0 0 1 0\r\n7 3 0 1 2 2 .5 .5\r\n"));
    EXPECT_EQ(read.F, (Faces(1, 3) << 0, 1, 2).finished());
    EXPECT_EQ(read.X, (Nodes(3, 3) << 0, 0, 0, 1, 0, 0, 0, 1, 0).finished());
}

class ReadStl : public testing::Test {
 protected:
    std::size_t facets(const std::string& bytes) {
        return read_stl(folder_.write("a.stl", bytes)).face_count();
    }

    const std::string text = ascii_stl_file(tetrahedron()), binary = binary_stl_file(tetrahedron());

 private:
    TemporaryFolder folder_;
};

TEST_F(ReadStl, ReadsTextsWithKeywordsInCapitalsEmptyLinesAndSeveralSolids) {
    std::string capitals = text;
    std::ranges::transform(capitals, capitals.begin(), [](unsigned char c) { return std::toupper(c); });
    EXPECT_EQ(facets(text), 4u);
    EXPECT_EQ(facets(capitals), 4u);
    EXPECT_EQ(facets("\n  \r\n" + text), 4u);
    EXPECT_EQ(facets("\xEF\xBB\xBF" + text), 4u);
    EXPECT_EQ(facets(text + capitals), 8u);
    EXPECT_EQ(facets(text.substr(0, text.find("endsolid"))), 4u);
}

TEST_F(ReadStl, ReadsBinaryFilesWithBytesBehindTheFacets) {
    EXPECT_EQ(facets(binary), 4u);
    EXPECT_EQ(facets(binary + std::string(7, '\0')), 4u);
    EXPECT_EQ(facets(binary + std::string(500, '\x13')), 4u);
}

TEST_F(ReadStl, ReadsBinaryFilesThatBeginWithSolid) {
    std::string named = binary;
    named.replace(0, 10, "solid part");
    EXPECT_EQ(facets(named), 4u);
    EXPECT_EQ(facets(named + "x"), 4u);
}

TEST_F(ReadStl, NamesThePlaceOfWhatIsWrong) {
    const auto with = [&](const std::string& from, const std::string& to) {
        return replaced(text, from, to);
    };
    const Refusals cases = {
        {binary.substr(0, 130), "STL: the file ends early: 4 facets take 284 bytes, but it has 130"},
        {"something",
         "neither a text that starts with \"solid\" nor a binary file: 9 bytes; allowed: at least 84"},
        {with("vertex 0 0 0", "vertex 0 x 0"), "line 4: expected a number, found 'x'"},
        {with("endloop", "endlop"), "line 7: expected vertex or endloop, found 'endlop'"},
        {with("outer loop", "inner loop"), "line 3: expected outer loop or endfacet, found 'inner'"},
        {with("   vertex 0 0 0\n", ""), "facet 0 has 2 vertices; allowed: at least 3"},
        {text.substr(0, text.find("endfacet")), "the file ends early, in a facet"}};
    expect_refused("a.stl", cases);
}

}  // namespace
}  // namespace nbd
