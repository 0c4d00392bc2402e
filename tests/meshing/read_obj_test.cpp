#include "meshing/formats/surface_formats.hpp"

#include <gtest/gtest.h>

#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

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

}  // namespace
}  // namespace nbd
