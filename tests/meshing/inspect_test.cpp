#include "meshing/h5/inspect.hpp"

#include <gtest/gtest.h>

#include "meshing/h5/reader.hpp"
#include "meshing/h5/sha256.hpp"
#include "meshing/h5/writer.hpp"
#include "tests/support/edit_file.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/failing_reads.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd::h5 {
namespace {

using test::error_of;
using InspectTest = test::FileTest;
using ReadErrors = test::FileTest;

std::filesystem::path write_example(const std::filesystem::path& folder) {
    const std::vector<double> x{1, 2, 3};
    Sha256 hash;
    add_dataset(hash, "a/x", Type::float64, {3}, x.data());
    Writer file(folder / "a.h5", {"nbdtree test", 4});
    file.attribute("/", "body_sha256", hash.hex());
    file.attribute("/", "body_sha256_of", "a/x");
    file.write("a/x", x);
    file.attribute("a", "seed", ~std::uint64_t{0});
    file.attribute("a", "young", 0.5);
    file.write("a/b/cells", {40000, 2}, std::span<const int>(std::vector<int>(80000, 7)));
    file.write_text("recipe", "{\n" + std::string(500, 'r') + "}");
    file.link("again", "/a/b");
    file.commit();
    return folder / "a.h5";
}

TEST_F(InspectTest, ListsTheWholeContentOfAFile) {
    const auto path = write_example(folder);
    const std::string text = inspect(path);
    EXPECT_EQ(text.find(path.string() + ": nbdtree test version 4, "), 0u) << text;
    for (const char* line :
         {"\n  @units = m, s, kg\n", "\n  @program_version = ", "\na/\n  @seed = 18446744073709551615\n",
          "\n  @young = 0.5\n", "\n  x: float64 3\n", "\n  b/\n    cells: int32 40000 x 2\n",
          "\nagain -> /a/b\n", "\nrecipe: \"{ rrr", "... (503 bytes)\"\n",
          "\nbody_sha256 matches the content\n",
          "\nwhole: 3 datasets, 320527 bytes of numbers and texts, every checksum verified\n"})
        EXPECT_NE(text.find(line), std::string::npos) << line << " is not in\n" << text;
}

TEST_F(InspectTest, DetectsADamagedChunkThatNothingElseReads) {
    const auto path = write_example(folder);
    std::string bytes = test::read_bytes(path);
    const std::size_t cells = bytes.find(std::string("\7\0\0\0\7\0\0\0\7\0\0\0", 12));
    ASSERT_NE(cells, std::string::npos);
    bytes[cells + 50000] ^= 1;
    test::write_bytes(path, bytes);
    const std::string error = error_of([&] { inspect(path); });
    test::expect_clear(error, path);
    EXPECT_NE(error.find("dataset 'a/b/cells' is damaged: "), std::string::npos) << error;
}

TEST_F(InspectTest, RejectsABodyWithAWrongHash) {
    const auto path = write_example(folder);
    test::EditFile(path).set("a/x", 1, 2.5);
    const std::string error = error_of([&] { inspect(path); });
    test::expect_clear(error, path);
    EXPECT_NE(error.find("the SHA-256 of the content is "), std::string::npos) << error;
}

// Files that the system cannot read.

const Format readable{"nbdtree test", 1};

TEST_F(ReadErrors, AreNeverTakenForAnAnswer) {
    const auto path = folder / "a.h5";
    Writer writer(path, readable);
    writer.write("group/numbers", std::vector<int>{1, 2, 3});
    writer.attribute("group", "name", "value");
    writer.write_text("text", "a text");
    writer.link("link", "/text");
    writer.commit();
    const int failed = test::with_each_read_failing(path, [&] {
        const Reader file(path, readable);
        EXPECT_TRUE(file.has("group/numbers"));
        EXPECT_FALSE(file.has("group/others"));
        EXPECT_TRUE(file.has_attribute("group", "name"));
        EXPECT_FALSE(file.has_attribute("group", "other"));
        EXPECT_EQ(file.link_target("link"), "/text");
        EXPECT_EQ(file.read_text("link"), "a text");
        EXPECT_EQ(file.read<int>("group/numbers", {any}).size(), 3u);
    });
    EXPECT_GT(failed, 4);
}

}  // namespace
}  // namespace nbd::h5
