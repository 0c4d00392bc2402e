#include "collision/nbd_tree/sphere_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include "tests/support/error_of.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

TEST(BoundingSphere, ContainsEveryListedVertexAtAnyScale) {
    std::srand(1);
    for (const float scale : {1e-3f, 1.f, 1e4f}) {
        const Vertices x = Vertices::Random(500, 3) * scale;
        std::vector<int> all(500);
        std::iota(all.begin(), all.end(), 0);
        const Sphere s = bounding_sphere(x, all);
        for (int v = 0; v < x.rows(); ++v)
            EXPECT_LE((x.row(v).transpose() - s.c).cast<double>().norm(), s.r) << "vertex " << v;
    }
}

TEST(BoundingSphere, IsCentredAtTheMeanOfTheVertices) {
    Vertices x(3, 3);
    x << 0, 0, 0, 3, 0, 0, 0, 3, 0;
    const Sphere s = bounding_sphere(x, std::vector<int>{0, 1, 2});
    EXPECT_NEAR((s.c - Eigen::Vector3f(1, 1, 0)).norm(), 0, 1e-6);
    EXPECT_NEAR(s.r, std::sqrt(5.f), 1e-5);
}

TEST(SphereTree, IsFullAtTheDefaultDepthForEnoughFaces) {
    const auto s = shapes::torus(48, 32);
    const SphereTree tree = build_sphere_tree(s.X, s.F);
    EXPECT_EQ(tree.nodes.size(), 255u);
    EXPECT_EQ(tree.depth(), 7);
    check_sphere_tree(tree, s.X.rows(), s.F);
}

TEST(SphereTree, NeverMakesLeavesSmallerThanTheMinimum) {
    for (const int least : {1, 2, 5, 17}) {
        const auto s = shapes::sphere(9, 11);
        const SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = 20, .min_leaf_faces = least});
        check_sphere_tree(tree, s.X.rows(), s.F);
        for (const SphereTree::Node& node : tree.nodes) {
            const int faces = node.face_end - node.face_begin;
            EXPECT_GE(faces, least);
            EXPECT_EQ(node.is_leaf(), faces < 2 * least);
        }
    }
}

TEST(SphereTree, GivesEveryNodeItsVerticesAndTheirBoundingSphere) {
    const auto s = shapes::bar(20, 12);
    const SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = 5});
    for (int i = 0; i < std::ssize(tree.nodes); ++i) {
        std::set<int> used, listed(tree.node_vertices(i).begin(), tree.node_vertices(i).end());
        for (const int f : tree.node_faces(i)) used.insert(s.F.row(f).begin(), s.F.row(f).end());
        EXPECT_EQ(used, listed) << "node " << i;
        const Sphere expected = bounding_sphere(s.X, tree.node_vertices(i));
        EXPECT_EQ(tree.rest[i].c, expected.c);
        EXPECT_EQ(tree.rest[i].r, expected.r);
    }
}

TEST(SphereTree, SplitsALineOfTrianglesInTheMiddle) {
    Vertices X(12, 3);
    Faces F(4, 3);
    for (int f = 0; f < 4; ++f) {
        const auto x = static_cast<float>(f == 0 ? 2 : f == 2 ? 0 : f);  // faces 0 and 2 are swapped
        X.row(3 * f) << x, 0, 0;
        X.row(3 * f + 1) << x, 0.1f, 0;
        X.row(3 * f + 2) << x, 0, 0.1f;
        F.row(f) << 3 * f, 3 * f + 1, 3 * f + 2;
    }
    const SphereTree tree = build_sphere_tree(X, F, {.depth = 1, .min_leaf_faces = 1});
    ASSERT_EQ(tree.nodes.size(), 3u);
    EXPECT_TRUE(std::ranges::equal(tree.node_faces(1), std::vector{1, 2}));
    EXPECT_TRUE(std::ranges::equal(tree.node_faces(2), std::vector{0, 3}));
}

TEST(SphereTree, SplitsEqualCentroidsByFaceIndex) {
    Vertices X(3, 3);
    X << 0, 0, 0, 1, 0, 0, 0, 1, 0;
    const Faces F = Eigen::RowVector3i(0, 1, 2).replicate(8, 1);
    const SphereTree tree = build_sphere_tree(X, F, {.depth = 3, .min_leaf_faces = 1});
    EXPECT_EQ(tree.nodes.size(), 15u);
    EXPECT_TRUE(std::ranges::is_sorted(tree.faces));
}

TEST(SphereTree, RejectsInvalidSurfacesAndConfigs) {
    const auto s = shapes::sphere(4, 5);
    EXPECT_EQ(test::refusal([&] { build_sphere_tree(s.X, Faces(0, 3)); }),
              "a tree needs at least one face, the surface has none");
    Faces F = s.F;
    F(3, 1) = 22;
    EXPECT_EQ(test::refusal([&] { build_sphere_tree(s.X, F); }),
              "face 3 refers to vertex 22, but the surface has 22 vertices");
    F(3, 1) = -1;
    EXPECT_EQ(test::refusal([&] { build_sphere_tree(s.X, F); }),
              "face 3 refers to vertex -1, but the surface has 22 vertices");
    Vertices X = s.X;
    X(7, 2) = std::numeric_limits<float>::infinity();
    EXPECT_EQ(test::refusal([&] { build_sphere_tree(X, s.F); }), "vertex 7 is not finite");
    X = s.X * 1e20f;
    EXPECT_EQ(test::refusal([&] { build_sphere_tree(X, s.F); }),
              "the surface is too large for float32: the sphere of node 0 overflows; positions should stay "
              "below 1e18 m");
    EXPECT_EQ(test::refusal([&] { build_sphere_tree(s.X, s.F, {.depth = 21}); }),
              "sphere tree depth is 21, allowed: 0 to 20");
    EXPECT_EQ(test::refusal([&] { build_sphere_tree(s.X, s.F, {.depth = -1}); }),
              "sphere tree depth is -1, allowed: 0 to 20");
    EXPECT_EQ(test::refusal([&] { build_sphere_tree(s.X, s.F, {.min_leaf_faces = 0}); }),
              "sphere tree min_leaf_faces is 0, allowed: 1 or more");
}

struct Tampering {
    const char* error;
    std::function<void(SphereTree&)> tamper;
};

// Refers to the tree of the sphere below: 70 faces, 37 vertices, 31 nodes, leaves 15 to 30.
const Tampering tamperings[] = {
    {"has no nodes", [](SphereTree& t) { t.nodes.clear(); }},
    {"node 14 has children at 29 and 30, but there are 30 nodes", [](SphereTree& t) { t.nodes.pop_back(); }},
    {"has 32 nodes, but the root reaches 31", [](SphereTree& t) { t.nodes.push_back(t.nodes.back()); }},
    {"lists 69 faces, but the surface has 70", [](SphereTree& t) { t.faces.pop_back(); }},
    {"lists face 70, but the surface has 70 faces", [](SphereTree& t) { t.faces[3] = 70; }},
    {"lists face -1, but", [](SphereTree& t) { t.faces[3] = -1; }},
    {"twice", [](SphereTree& t) { t.faces[3] = t.faces[4]; }},
    {"the root owns vertices 0 to", [](SphereTree& t) { t.vertices.pop_back(); }},
    {"lists vertex 37, but the surface has 37 vertices", [](SphereTree& t) { t.vertices[3] = 37; }},
    {"lists vertex -2, but", [](SphereTree& t) { t.vertices[3] = -2; }},
    {"leaf 15 lists vertex", [](SphereTree& t) { t.vertices[3] = t.vertices[4]; }},
    {"does not list vertex", [](SphereTree& t) { std::swap(t.vertices.front(), t.vertices.back()); }},
    {"does not list vertex", [](SphereTree& t) { std::swap(t.faces.front(), t.faces.back()); }},
    {"but none of its faces uses it",
     [](SphereTree& t) {
         for (auto& n : t.nodes) {
             n.vertex_begin += n.vertex_begin > 0;
             ++n.vertex_end;
         }
         t.vertices.insert(t.vertices.begin(), t.vertices.back());
     }},
    {"the root has depth 1 instead of 0", [](SphereTree& t) { t.nodes[0].depth = 1; }},
    {"the children of node 2 have depths 5 and 2 instead of 2", [](SphereTree& t) { t.nodes[5].depth = 5; }},
    {"the root owns faces 1 to 70 of 70", [](SphereTree& t) { t.nodes[0].face_begin = 1; }},
    {"the root owns faces 0 to 71 of 70", [](SphereTree& t) { t.nodes[0].face_end = 71; }},
    {"do not partition its faces", [](SphereTree& t) { ++t.nodes[4].face_end; }},
    {"do not partition its vertices", [](SphereTree& t) { --t.nodes[4].vertex_begin; }},
    {"node 15 owns no face", [](SphereTree& t) { t.nodes[16].face_begin = t.nodes[15].face_end = 0; }},
    {"node 15 owns no vertex", [](SphereTree& t) { t.nodes[16].vertex_begin = t.nodes[15].vertex_end = 0; }},
    {"node 3 has its first child at 9, allowed in breadth-first order: 7 or -1",
     [](SphereTree& t) { std::swap(t.nodes[3].first_child, t.nodes[4].first_child); }},
    {"node 3 has its first child at 0", [](SphereTree& t) { t.nodes[3].first_child = 0; }},
    {"node 20 has its first child at -7", [](SphereTree& t) { t.nodes[20].first_child = -7; }},
    {"node 20 has its first child at 2147483647",
     [](SphereTree& t) { t.nodes[20].first_child = 2147483647; }},
    {"has 30 rest spheres for 31 nodes", [](SphereTree& t) { t.rest.pop_back(); }},
    {"the rest sphere of node 9 is not finite", [](SphereTree& t) { t.rest[9].c[1] = NAN; }},
    {"the rest sphere of node 9 is not finite", [](SphereTree& t) { t.rest[9].r = INFINITY; }},
    {"the rest sphere of node 9 has a negative radius", [](SphereTree& t) { t.rest[9].r = -1; }},
};

TEST(CheckSphereTree, ReportsEachKindOfTampering) {
    const auto s = shapes::sphere(5, 7);
    const SphereTree whole = build_sphere_tree(s.X, s.F, {.depth = 4, .min_leaf_faces = 2});
    ASSERT_EQ(whole.nodes.size(), 31u);
    ASSERT_EQ(s.X.rows(), 37);
    check_sphere_tree(whole, 37, s.F);
    for (const Tampering& t : tamperings) {
        SphereTree tree = whole;
        t.tamper(tree);
        const std::string error = test::refusal([&] { check_sphere_tree(tree, 37, s.F); });
        EXPECT_TRUE(error.starts_with("sphere tree: ")) << error;
        const std::string expected = t.error;
        EXPECT_NE(error.find(expected), std::string::npos) << error << "\nshould say: " << expected;
    }
}

TEST(CheckSphereTree, RejectsATreeOfAnotherSurface) {
    const auto s = shapes::sphere(5, 7), other = shapes::sphere(7, 5);
    const SphereTree tree = build_sphere_tree(s.X, s.F);
    ASSERT_EQ(s.F.rows(), other.F.rows());
    EXPECT_NE(test::refusal([&] { check_sphere_tree(tree, 37, other.F); }), "");
    EXPECT_EQ(test::refusal([&] { check_sphere_tree(tree, 36, s.F); }),
              "sphere tree: face 63 refers to vertex 36, but the surface has 36 vertices");
    EXPECT_EQ(test::refusal([&] { check_sphere_tree(tree, 37, Faces(0, 3)); }),
              "sphere tree: the surface has no faces");
}

}  // namespace
}  // namespace nbd
