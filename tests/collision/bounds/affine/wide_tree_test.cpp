#include "collision/bounds/affine/wide_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/error_of.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

TEST(WideTree, HoldsEveryFaceOnceInFullLeaves) {
    for (const auto& surface : {shapes::sphere(3, 4), shapes::torus(30, 20), shapes::torus(120, 90)}) {
        const WideTree tree = build_wide_tree(surface.X, surface.F);
        std::vector<int> seen;
        int leaves = 0;
        for (int leaf = 0; leaf < tree.leaves(); ++leaf) {
            const int count = tree.faces_in[static_cast<std::size_t>(leaf)];
            leaves += count > 0;
            for (int k = 0; k < WideTree::width; ++k) {
                const int face = tree.faces[static_cast<std::size_t>(WideTree::width * leaf + k)];
                EXPECT_EQ(face >= 0, k < count);
                if (k >= count) continue;
                seen.push_back(face);
                for (int c = 0; c < 3; ++c)
                    EXPECT_EQ(tree.leaf_vertices(leaf)[tree.corners[static_cast<std::size_t>(
                                  leaf)][static_cast<std::size_t>(WideTree::width * c + k)]],
                              surface.F(face, c));
            }
        }
        std::ranges::sort(seen);
        ASSERT_EQ(seen.size(), static_cast<std::size_t>(surface.F.rows()));
        for (std::size_t f = 0; f < seen.size(); ++f) EXPECT_EQ(seen[f], static_cast<int>(f));
        EXPECT_LE(leaves, (surface.F.rows() * 9 / 8 + 15) / 16 + 1) << "leaves are not full";
    }
}

TEST(WideTree, RefusesSurfacesThatAreNone) {
    auto [X, F] = shapes::sphere(3, 4);
    const auto error = [](const Vertices& x, const Faces& f) {
        return test::error_of([&] { build_wide_tree(x, f); });
    };
    EXPECT_NE(error(X, Faces(0, 3)), "");
    F(2, 1) = 1000;
    EXPECT_NE(error(X, F).find("face 2 refers to vertex 1000"), std::string::npos);
    F(2, 1) = 0;
    X(1, 1) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(error(X, F), "vertex 1 is not finite");
}

}  // namespace
}  // namespace nbd
