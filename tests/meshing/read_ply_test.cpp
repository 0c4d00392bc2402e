#include <gtest/gtest.h>

#include <array>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "meshing/formats/read_surface.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using namespace test;

TEST(ReadSurface, ReportsErrorsInPlyFiles) {
    const TemporaryFolder folder;
    const std::string good = ascii_ply_file(tetrahedron());
    const auto with = [&](const std::string& from, const std::string& to) {
        std::string text = good;
        text.replace(text.find(from), from.size(), to);
        return text;
    };
    const std::vector<std::pair<std::string, std::string>> cases = {
        {with("ascii", "ebcdic"), "unknown format \"ebcdic\""},
        {with("format ascii 1.0\n", ""), "no \"format\" line"},
        {with("float x", "floot x"), "unknown type \"floot\""},
        {with("property float z\n", ""), "no vertex property \"z\""},
        {with("vertex_indices", "corners"), "no face property \"vertex_indices\""},
        {with("end_header\n", ""), "unknown keyword"},
        {with("element vertex 4\n", ""), "a property comes before the first element"},
        {with("face 4", "face 5"), "the file ends early, in face 4 of 5"},
        {with("face 4", "face 0"), "no faces in the file"},
        {with("3 0", "3 9"), "face 0 refers to vertex 9, but the file has 4 vertices"},
        {with("3 0", "3 -1"), "face 0 refers to vertex -1, but the file has 4 vertices"},
        {with("3 0", "-3 0"), "face 0 has a list of -3 entries"},
        {with("3 0", "3 0.5"), "face 0 refers to vertex 0.5"},
        {with("1 0 0", "nan 0 0"), "vertex 1 is not finite: (nan, 0, 0)"},
        {with("1 0 0", "1e99 0 0"), "vertex 1 is too far away: (1e+99, 0, 0); allowed: up to 3.4e+38 m"}};
    for (const auto& [content, text] : cases) {
        const std::string error = reading_error(folder.write("a.ply", content));
        EXPECT_NE(error.find(text), std::string::npos) << "\"" << error << "\" without \"" << text << '"';
    }
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

TEST(ReadSurface, TurnsEverySecondTriangleOfAPlyStrip) {
    const TemporaryFolder folder;
    EXPECT_EQ(read_surface(folder.write("a.ply", ply_of_strips("5 0 1 2 3 4\n", 1))).F,
              faces({{0, 1, 2}, {2, 1, 3}, {2, 3, 4}}));
}

TEST(ReadSurface, StartsAStripAnewAtMinusOneAndAtEachList) {
    const TemporaryFolder folder;
    const Faces expected = faces({{0, 1, 2}, {2, 1, 3}, {2, 3, 4}});
    EXPECT_EQ(read_surface(folder.write("a.ply", ply_of_strips("9 0 1 2 3 -1 2 3 4 -1\n", 1))).F, expected);
    EXPECT_EQ(read_surface(folder.write("b.ply", ply_of_strips("4 0 1 2 3\n3 2 3 4\n", 2))).F, expected);
}

TEST(ReadSurface, SkipsTheTrianglesThatJoinStrips) {
    const TemporaryFolder folder;
    // 0 1 2, then the joints 1 2 2, 2 2 3 and 2 3 3, then 3 3 4 and 3 4 1.
    EXPECT_EQ(read_surface(folder.write("a.ply", ply_of_strips("8 0 1 2 2 3 3 4 1\n", 1))).F,
              faces({{0, 1, 2}, {4, 3, 1}}));
}

TEST(ReadSurface, ReportsErrorsInPlyStrips) {
    const TemporaryFolder folder;
    const std::vector<std::pair<std::string, std::string>> cases = {
        {"3 0 1 5\n", "face 0 refers to vertex 5, but the file has 5 vertices"},
        {"3 0 1 -2\n", "face 0 refers to vertex -2, but the file has 5 vertices"},
        {"3 0 1 1.5\n", "strip 0 refers to vertex 1.5"},
        {"4 0 1 2\n", "the file ends early, in tristrips 0 of 1"},
        {"2 0 1\n", "no faces in the file"}};
    for (const auto& [strips, problem] : cases)
        EXPECT_NE(reading_error(folder.write("a.ply", ply_of_strips(strips, 1))).find(problem),
                  std::string::npos)
            << reading_error(folder.write("a.ply", ply_of_strips(strips, 1)));
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

}  // namespace
}  // namespace nbd
