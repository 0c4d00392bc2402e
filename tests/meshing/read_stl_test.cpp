#include "meshing/formats/surface_formats.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>

#include "meshing/formats/read_surface.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using namespace test;

class ReadStl : public testing::Test {
 protected:
    std::size_t facets(const std::string& bytes) {
        return read_stl(folder_.write("a.stl", bytes)).face_count();
    }
    std::string refusal(const std::string& bytes) {
        const auto path = folder_.write("a.stl", bytes);
        return error_of([&] { read_surface(path); });
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
        std::string changed = text;
        return changed.replace(changed.find(from), from.size(), to);
    };
    const std::vector<std::pair<std::string, std::string>> cases = {
        {binary.substr(0, 130), "STL: the file ends early: 4 facets take 284 bytes, but it has 130"},
        {"something",
         "neither a text that starts with \"solid\" nor a binary file: 9 bytes; allowed: at least 84"},
        {with("vertex 0 0 0", "vertex 0 x 0"), "line 4: expected a number, found 'x'"},
        {with("endloop", "endlop"), "line 7: expected vertex or endloop, found 'endlop'"},
        {with("outer loop", "inner loop"), "line 3: expected outer loop or endfacet, found 'inner'"},
        {with("   vertex 0 0 0\n", ""), "facet 0 has 2 vertices; allowed: at least 3"},
        {text.substr(0, text.find("endfacet")), "the file ends early, in a facet"}};
    for (const auto& [bytes, problem] : cases)
        EXPECT_NE(refusal(bytes).find(problem), std::string::npos) << refusal(bytes) << "\n" << problem;
}

}  // namespace
}  // namespace nbd
