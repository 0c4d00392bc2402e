#include "meshing/formats/read_surface.hpp"

#include <fstream>

#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

/// About how many faces a file of these bytes holds. bytes_more: zeros at its end.
std::uint64_t faces_of(const std::string& name, const std::string& content, std::uintmax_t bytes_more = 0) {
    const test::TemporaryFolder folder;
    const auto path = folder.path() / name;
    std::ofstream(path, std::ios::binary) << content;
    std::filesystem::resize_file(path, content.size() + bytes_more);
    return estimate_faces(path);
}

TEST(EstimateFaces, ReadsHeadersAndCountsLines) {
    const std::string ply = "ply\nformat ascii 1.0\nelement vertex 3\nelement face 1000\nend_header\n";
    EXPECT_EQ(faces_of("a.ply", ply, 4000), 1000u);
    EXPECT_EQ(faces_of("a.PLY", ply, 4000), 1000u);
    EXPECT_EQ(faces_of("a.off", "OFF # a comment\n# another\n 500 1000 0\n", 9000), 1000u);
    EXPECT_EQ(faces_of("a.obj", "v 0 0 0\nf 1 2 3\nvn 1 0 0\nf 1 2 3\n# f\nf 3 2 1\n"), 3u);
    const std::string stl = std::string(80, ' ') + std::string("\x10\x27\0\0", 4);
    EXPECT_EQ(faces_of("a.stl", stl, 500000), 10000u);
    EXPECT_EQ(faces_of("text.stl", "solid a\n", 200000), 1000u);
}

TEST(EstimateFaces, BelievesNoHeaderThatItsFileCannotHold) {
    EXPECT_LT(faces_of("a.ply", "ply\nelement face 4000000000000\nend_header\n"), 20u);
    EXPECT_LT(faces_of("a.off", "OFF\n1 4000000000000 0\n"), 5u);
    EXPECT_EQ(faces_of("a.ply", ""), 0u);
    EXPECT_EQ(faces_of("a.off", ""), 0u);
    EXPECT_EQ(faces_of("a.stl", ""), 0u);
    EXPECT_EQ(estimate_faces("none.ply"), 0u);
    EXPECT_EQ(estimate_faces("/"), 0u);
}

}  // namespace
}  // namespace nbd
