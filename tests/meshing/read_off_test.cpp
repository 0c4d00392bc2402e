#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "meshing/formats/read_surface.hpp"
#include "tests/meshing/surface_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using namespace test;

TEST(ReadSurface, ReportsErrorsInOffFiles) {
    const TemporaryFolder folder;
    const std::vector<std::pair<std::string, std::string>> cases = {
        {"3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "does not start with \"OFF\""},
        {"4OFF\n3 1 0\n", "\"4OFF\" is not three-dimensional"},
        {"OFF\n# nothing else\n", "the file ends early, before the counts"},
        {"OFF BINARY\n", "the header: \"BINARY\" is not a number"},
        {"OFF\n3 999999999 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "ends early, before face 1 of 999999999"},
        {"OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n", "ends early, before vertex 3 of 4"},
        {"OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n", "vertex 1 of 3 ends early"},
        {"OFF\n3 1 0\n0 0 0\n1x 0 0\n0 1 0\n3 0 1 2\n", "\"1x\" is not a number"},
        {"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n9 0 1 2\n", "face 0 of 1 ends early"},
        {"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n",
         "face 0 refers to vertex 7, but the file has 3 vertices"},
        {"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", "face 0 refers to vertex -1"},
        {"OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "no faces in the file"}};
    for (const auto& [content, text] : cases) {
        const std::string error = reading_error(folder.write("a.off", content));
        EXPECT_NE(error.find(text), std::string::npos) << "\"" << error << "\" without \"" << text << '"';
    }
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

}  // namespace
}  // namespace nbd
