#include "collision/wide_tree/wide_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <span>

#include "collision/flat/crc64.hpp"
#include "collision/nbd_tree/sphere_tree.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

/// Expects a tree that holds every face of a surface once; returns the number of its leaves.
int leaves_of(const WideTree& tree, const Faces& F) {
    std::vector<int> seen;
    int leaves = 0;
    for (int leaf = 0; leaf < tree.leaves(); ++leaf) {
        const int count = tree.faces_in[leaf];
        leaves += count > 0;
        for (int k = 0; k < tree_width; ++k) {
            const int face = tree.faces[tree_width * leaf + k];
            EXPECT_EQ(face >= 0, k < count);
            if (k >= count) continue;
            seen.push_back(face);
            for (int c = 0; c < 3; ++c)
                EXPECT_EQ(tree.leaf_vertices(leaf)[tree.corners[leaf][tree_width * c + k]], F(face, c));
        }
    }
    std::ranges::sort(seen);
    EXPECT_EQ(seen.size(), static_cast<std::size_t>(F.rows()));
    for (std::size_t f = 0; f < seen.size(); ++f) EXPECT_EQ(seen[f], static_cast<int>(f));
    return leaves;
}

TEST(WideTree, HoldsEveryFaceOnce) {
    for (const auto& [X, F] : {shapes::sphere(3, 4), shapes::torus(30, 20), shapes::torus(120, 90)}) {
        const WideTree full = build_wide_tree(X, F);
        EXPECT_LE(leaves_of(full, F), (F.rows() * 9 / 8 + 15) / 16 + 1) << "leaves are not full";
        const std::vector<int> order = build_sphere_tree(X, F, {}).faces;
        const WideTree halved = build_wide_tree(order, F, X.rows());
        EXPECT_LE(leaves_of(halved, F), F.rows() / 8) << "leaves are not half full";
        EXPECT_TRUE(is_over(halved, X.rows(), F));
        for (const WideTree* tree : {&full, &halved}) {
            EXPECT_LE(tree->clusters(), most_clusters(F.rows()));
            EXPECT_GE(2 * tree->clusters(), most_clusters(F.rows()));
        }
    }
}

/// Files hold samples for each part of a tree, which is built again from the surface.
TEST(WideTree, IsTheTreeOfEarlierFiles) {
    const auto [X, F] = shapes::torus(120, 90);
    const auto hash = [](const WideTree& tree) {
        const auto of = [](const auto& numbers) { return crc64(std::as_bytes(std::span(numbers))); };
        return of(tree.faces) ^ of(tree.first_block) ^ of(tree.vertices);
    };
    EXPECT_EQ(hash(build_wide_tree(X, F)), 0x16156b256ecea6a4u);
    EXPECT_EQ(hash(build_wide_tree(build_sphere_tree(X, F, {}).faces, F, X.rows())), 0xd2c191cfcf9cdaa2u);
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
