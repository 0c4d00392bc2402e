#include <fmt/format.h>
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/apps/small_files.hpp"

namespace nbd {
namespace {

using Mesh = test::BoxFolder;

/// A tetrahedron with another on one of its faces; `height` is that of the other.
std::string two_tetrahedra(double height) {
    const double at = (1 + height) / 3;
    return fmt::format(
        "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n"
        "0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n{0} {0} {0} 0\n"
        "Tetrahedra\n2\n1 2 3 4 0\n2 3 4 5 0\nEnd\n",
        at);
}

TEST_F(Mesh, WarnsOfTetrahedraThatMakeStepsStiff) {
    write("flat.mesh", two_tetrahedra(0.02));
    const test::Ran flat = test::run(folder(), {"mesh", "flat.mesh", "-o", "flat.h5", "--json"});
    EXPECT_EQ(flat.status, 0) << flat.err;
    EXPECT_THAT(flat.err,
                testing::StartsWith("nbdtree: warning: 1 of 2 tetrahedra have a radius ratio below 0.1, "
                                    "the worst is tetrahedron 1 with "));
    EXPECT_EQ(nlohmann::json::parse(flat.out)["slivers"], 1);

    write("good.mesh", two_tetrahedra(1));
    const test::Ran good = test::run(folder(), {"mesh", "good.mesh", "-o", "good.h5", "--json"});
    EXPECT_EQ(good.status, 0) << good.err;
    EXPECT_EQ(good.err, "");
    EXPECT_EQ(nlohmann::json::parse(good.out)["slivers"], 0);
}

}  // namespace
}  // namespace nbd
