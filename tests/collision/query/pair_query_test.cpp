#include "collision/query/pair_query.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "collision/nbd_tree/leaf_boxes.hpp"
#include "tests/collision/wide_tree/hung_surface.hpp"
#include "tests/support/brute_force.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

using shapes::Surface;
using test::brute_force_intersecting;
using test::brute_force_within;

PosedTree exact_tree(const Surface& s, const SphereTreeConfig& config = {},
                     BoundKind kind = BoundKind::exact) {
    return {shared_exact_tree(s.X, s.F, config), kind};
}

struct Case {
    const char* name;
    Surface a, b;
    SphereTreeConfig config_a, config_b;
};

std::vector<Case> cases() {
    return {
        {"tori", shapes::torus(24, 12), shapes::torus(20, 14), {}, {}},
        {"sphere in torus", shapes::sphere(12, 18, 0.4f), shapes::torus(24, 12), {.depth = 3}, {.depth = 6}},
        {"bars", shapes::bar(16, 9), shapes::bar(13, 11), {.depth = 5, .min_leaf_faces = 1}, {.depth = 0}},
        {"unlike sizes", shapes::sphere(3, 4, 0.2f), shapes::torus(40, 30), {.depth = 2}, {.depth = 20}},
        {"boxes alone, three levels and more",
         shapes::sphere(30, 40),
         shapes::torus(24, 24),
         {.depth = 0},
         {.depth = 0}},
        {"more than one cluster of boxes", shapes::torus(120, 90), shapes::sphere(5, 8, 0.4f), {}, {}},
    };
}

TEST(PairQuery, AgreesWithBruteForceInRandomPoses) {
    std::mt19937 random(1);
    PairQuery query;
    int touching_poses = 0, apart_poses = 0;
    std::size_t pairs = 0;
    for (const Case& c : cases()) {
        PosedTree a = exact_tree(c.a, c.config_a), b = exact_tree(c.b, c.config_b);
        PosedTree boxes_a = exact_tree(c.a, c.config_a, BoundKind::boxes),
                  boxes_b = exact_tree(c.b, c.config_b, BoundKind::boxes);
        for (int pose = 0; pose < 12; ++pose) {
            // Offsets leave few digits in the coordinates; the answer must not depend on them.
            const Eigen::Vector3f offset =
                pose % 4 == 3 ? Eigen::Vector3f(900, -700, 400) : Eigen::Vector3f(0, 0, 0);
            const auto place = [&](const Surface& s) -> Vertices {
                const Vertices x =
                    shapes::moved(shapes::wobbled(s.X, random, 0.05f), shapes::random_motion(random, 0.5f));
                return x.rowwise() + offset.transpose();
            };
            const Vertices x = place(c.a), y = place(c.b);
            a.begin_pose(x);
            b.begin_pose(y);
            const auto expected = brute_force_intersecting(x, c.a.F, y, c.b.F);
            EXPECT_EQ(test::listed(query.intersecting(a, b)), expected) << c.name << ", pose " << pose;
            EXPECT_EQ(query.counters().face_pairs, static_cast<long>(expected.size()));
            boxes_a.begin_pose(x);
            boxes_b.begin_pose(y);
            EXPECT_EQ(test::listed(query.intersecting(boxes_a, boxes_b)), expected) << "boxes of " << c.name;
            EXPECT_EQ(test::listed(query.intersecting(boxes_a, b)), expected)
                << "boxes and spheres of " << c.name;
            ++(expected.empty() ? apart_poses : touching_poses);
            pairs += expected.size();
        }
    }
    EXPECT_GE(touching_poses, 20);
    EXPECT_GE(apart_poses, 4);
    EXPECT_GE(pairs, 1000u);
}

TEST(PairQuery, WithinAgreesWithBruteForce) {
    std::mt19937 random(5);
    PairQuery query;
    const Surface s = shapes::torus(14, 8), t = shapes::bar(9, 7);
    PosedTree a = exact_tree(s, {.depth = 5}), b = exact_tree(t, {.depth = 3}, BoundKind::boxes);
    PosedTree boxes_a = exact_tree(s, {.depth = 5}, BoundKind::boxes);
    std::size_t pairs = 0, intersecting = 0, boxes_within = 0;
    for (int pose = 0; pose < 6; ++pose) {
        const Vertices x =
            shapes::moved(shapes::wobbled(s.X, random, 0.05f), shapes::random_motion(random, 0.4f));
        const Vertices y =
            shapes::moved(shapes::wobbled(t.X, random, 0.05f), shapes::random_motion(random, 0.4f));
        a.begin_pose(x);
        boxes_a.begin_pose(x);
        b.begin_pose(y);
        intersecting += query.intersecting(a, b).size();
        for (const float distance : {0.f, 0.01f, 0.1f}) {
            const auto expected = brute_force_within(x, s.F, y, t.F, distance);
            EXPECT_EQ(test::listed(query.within(a, b, distance)), expected)
                << "pose " << pose << ", " << distance << " m";
            EXPECT_EQ(test::listed(query.within(boxes_a, b, distance)), expected) << "boxes";
            pairs += expected.size();
            const auto boxes = test::sorted(query.boxes_within(a, b, distance));
            EXPECT_TRUE(std::ranges::includes(boxes, expected));
            boxes_within += boxes.size();
        }
        EXPECT_EQ(test::listed(query.within(a, b, 0)), test::listed(query.intersecting(a, b)));
    }
    EXPECT_GT(intersecting, 50u);
    EXPECT_GT(pairs, 10 * intersecting);
    EXPECT_LT(boxes_within, 5 * pairs);
}

TEST(PairQuery, CountsPairsAtExactlyTheGivenDistance) {
    // Parallel triangles with a gap that float32 represents exactly.
    Vertices X(3, 3), Y(3, 3);
    X << 0, 0, 0, 1, 0, 0, 0, 1, 0;
    for (const float gap : {0.375f, 0.1f, 1e-6f, 3e10f}) {
        Y = X;
        Y.col(2).setConstant(gap);
        const Faces F = Eigen::RowVector3i(0, 1, 2);
        PosedTree a = exact_tree({X, F}), b = exact_tree({Y, F});
        a.begin_pose(X);
        b.begin_pose(Y);
        PairQuery query;
        EXPECT_EQ(query.within(a, b, gap).size(), 1u) << gap;
        EXPECT_EQ(query.within(a, b, std::nextafter(gap, 0.f)).size(), 0u) << gap;
    }
}

TEST(PairQuery, CountsFacesThatTouchInAPoint) {
    // Two tetrahedra share the corner (1, 1, 1), which is exact in both.
    Vertices X(4, 3), Y(4, 3);
    X << 1, 1, 1, 2, 1, 1, 1, 2, 1, 1, 1, 2;
    Y << 1, 1, 1, 0, 1, 1, 1, 0, 1, 1, 1, 0;
    Faces F(4, 3);
    F << 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3;
    PosedTree a = exact_tree({X, F}), b = exact_tree({Y, F});
    a.begin_pose(X);
    b.begin_pose(Y);
    PairQuery query;
    EXPECT_EQ(query.intersecting(a, b).size(), 9u);
}

TEST(PairQuery, RefusesDistancesAndBodiesThatItCannotUse) {
    const Surface s = shapes::torus(12, 8);
    PosedTree a = exact_tree(s), b = exact_tree(s);
    a.begin_pose(s.X);
    b.begin_pose(s.X);
    PairQuery query;
    constexpr float infinite = std::numeric_limits<float>::infinity();
    const std::string negative = "distance is -1 m, allowed: finite, 0 or more";
    EXPECT_EQ(test::refusal([&] { query.within(a, b, -1); }), negative);
    EXPECT_EQ(test::refusal([&] { query.boxes_within(a, b, -1); }), negative);
    EXPECT_EQ(test::refusal([&] { query.within(a, b, infinite); }),
              "distance is inf m, allowed: finite, 0 or more");
    EXPECT_EQ(test::refusal([&] { query.box_leaves_within(a, b, 0, [](int, int) { return 0.f; }); }),
              "leaves of box trees of a body with exact bounds; allowed: boxes, affine, learned_affine");
}

TEST(PairQuery, QueriesATreeAgainstItself) {
    const test::HungSurface hung = test::hung_on_itself(shapes::torus(16, 12));
    const Surface& s = hung.surface;
    PairQuery query;
    for (const BoundKind kind : {BoundKind::exact, BoundKind::boxes, BoundKind::affine}) {
        PosedTree tree(test::hung_tree(hung, {.depth = 3}), kind);
        kind == BoundKind::affine ? tree.begin_pose_of_nodes(s.X) : tree.begin_pose(s.X);
        EXPECT_EQ(test::listed(query.intersecting(tree, tree)), brute_force_intersecting(s.X, s.F, s.X, s.F));
    }
}

TEST(PairQuery, BoxLeavesHoldAllPairsWhoseBoxesAreNear) {
    const Surface a = shapes::torus(60, 40), b = shapes::sphere(30, 40, 0.5f);
    PosedTree s = exact_tree(a, {}, BoundKind::boxes), t = exact_tree(b, {}, BoundKind::boxes);
    ASSERT_EQ(exact_tree(a).box_tree(), nullptr);
    const WideTree &in_s = *s.box_tree(), &in_t = *t.box_tree();
    s.begin_pose(a.X);
    const Vertices moved = b.X.rowwise() + Eigen::RowVector3f(0.7f, 0.1f, 0.3f);
    t.begin_pose(moved);
    for (const float distance : {0.f, 0.05f}) {
        PairQuery query;
        const auto leaves = query.box_leaves_within(s, t, distance, [&](int, int) { return distance; });
        const std::vector<LeafPair> found(leaves.begin(), leaves.end());
        EXPECT_TRUE(std::ranges::is_sorted(found));
        EXPECT_LT(static_cast<long>(found.size()), long{in_s.leaves()} * in_t.leaves() / 4);
        std::vector<FacePair> held;
        for (const LeafPair& pair : found)
            for (int i = 0; i < in_s.faces_in[pair.a]; ++i)
                for (int j = 0; j < in_t.faces_in[pair.b]; ++j)
                    held.push_back(
                        {in_s.faces[tree_width * pair.a + i], in_t.faces[tree_width * pair.b + j]});
        std::ranges::sort(held);
        const auto near = test::sorted(query.boxes_within(s, t, distance));
        EXPECT_GT(near.size(), 100u);
        EXPECT_TRUE(std::ranges::includes(held, near));
    }
    PairQuery query;
    const auto leaves_of = [&](const BlockReach& reach) {
        const auto leaves = query.box_leaves_within(s, t, 0.05f, reach);
        return std::vector<LeafPair>(leaves.begin(), leaves.end());
    };
    const auto reach = [](int block_a, int block_b) { return (block_a + block_b) % 2 == 0 ? 0.05f : 0.01f; };
    const auto far = leaves_of([](int, int) { return 0.05f; }),
               near = leaves_of([](int, int) { return 0.01f; });
    std::vector<LeafPair> expected;
    for (const LeafPair& pair : far)
        if (reach(pair.a / tree_width, pair.b / tree_width) == 0.05f ||
            std::ranges::binary_search(near, pair))
            expected.push_back(pair);
    EXPECT_GT(expected.size(), near.size());
    EXPECT_LT(expected.size(), far.size());
    EXPECT_EQ(leaves_of(reach), expected) << "each block with its own reach";
}

TEST(PairQuery, BoundsANodeOncePerPoseAndOnlyIfItsParentCollides) {
    const Surface s = shapes::torus(48, 32);
    PosedTree a = exact_tree(s), b = exact_tree(s);
    PairQuery query;
    Vertices y = s.X;

    a.begin_pose(s.X);
    y.col(0).array() += 10.f;  // out of reach: the roots suffice
    b.begin_pose(y);
    query.intersecting(a, b);
    EXPECT_EQ(query.counters().nodes_bounded, 2);
    EXPECT_EQ(query.counters().node_tests, 1);
    EXPECT_EQ(query.counters().boxes_refitted, 0);
    EXPECT_EQ(a.nodes_bounded(), 1);

    y.col(0).array() -= 8.65f;  // side by side: one region of either tree
    b.begin_pose(y);
    EXPECT_GT(query.intersecting(a, b).size(), 0u);
    const QueryCounters first = query.counters();
    EXPECT_GT(first.nodes_bounded, 20);
    EXPECT_LT(first.nodes_bounded, 255);
    EXPECT_GT(first.leaf_pairs, 0);
    EXPECT_LT(first.boxes_refitted, 128);  // half of all leaves
    EXPECT_LT(first.triangle_tests, 100 * first.face_pairs);
    EXPECT_EQ(a.nodes_bounded() + b.nodes_bounded(),
              first.nodes_bounded + 1);  // the root of a was bounded before

    query.intersecting(a, b);  // the same pose again costs only tests
    EXPECT_EQ(query.counters().nodes_bounded, 0);
    EXPECT_EQ(query.counters().boxes_refitted, 0);
    EXPECT_EQ(query.counters().node_tests, first.node_tests);
    EXPECT_EQ(query.counters().face_pairs, first.face_pairs);

    a.begin_pose(s.X);
    query.intersecting(a, b);
    EXPECT_EQ(query.counters().nodes_bounded, a.nodes_bounded());
    EXPECT_GT(query.counters().boxes_refitted, 0);
}

Surface read_obj(const std::filesystem::path& path) {
    std::vector<Eigen::Vector3f> X;
    std::vector<Eigen::Vector3i> F;
    std::ifstream in(path);
    for (std::string key; in >> key;) {
        if (key == "v") in >> X.emplace_back().x() >> X.back().y() >> X.back().z();
        if (key == "f") in >> F.emplace_back().x() >> F.back().y() >> F.back().z();
        in.ignore(1000, '\n');
    }
    Surface s{Vertices(X.size(), 3), Faces(F.size(), 3)};
    for (std::size_t i = 0; i < X.size(); ++i) s.X.row(i) = X[i];
    for (std::size_t i = 0; i < F.size(); ++i) s.F.row(i) = F[i].array() - 1;
    return s;
}

/// Two wobbled surfaces, the second moved at random: the query finds the pairs that brute force finds, more
/// than `least`.
void expect_pairs_of_brute_force(const Surface& first, const Surface& second, std::size_t least) {
    PosedTree a = exact_tree(first), b = exact_tree(second);
    PairQuery query;
    std::mt19937 random(4);
    const Vertices x = shapes::wobbled(first.X, random, 0.02f);
    const Vertices y =
        shapes::moved(shapes::wobbled(second.X, random, 0.02f), shapes::random_motion(random, 0.2f));
    a.begin_pose(x);
    b.begin_pose(y);
    const auto expected = brute_force_intersecting(x, first.F, y, second.F);
    EXPECT_GT(expected.size(), least);
    EXPECT_EQ(test::listed(query.intersecting(a, b)), expected);
}

TEST(PairQuery, AgreesWithBruteForceOnScannedMeshes) {
    const std::filesystem::path folder = NBD_SHARED_MESHES;
    if (!std::filesystem::exists(folder / "bob.obj")) GTEST_SKIP() << "no meshes at " << folder;
    const Surface bob = read_obj(folder / "bob.obj"), spot = read_obj(folder / "spot.obj");
    ASSERT_EQ(bob.F.rows(), 6000);
    ASSERT_EQ(spot.X.rows(), 3002);
    expect_pairs_of_brute_force(bob, spot, 50);
}

TEST(PairQuery, AgreesWithBruteForceOnTheAssets) {
    const std::filesystem::path folder = NBD_ASSETS;
    expect_pairs_of_brute_force(read_obj(folder / "gecko.obj"), read_obj(folder / "ring.obj"), 20);
    expect_pairs_of_brute_force(read_obj(folder / "gear.obj"), read_obj(folder / "beam.obj"), 20);
}

}  // namespace
}  // namespace nbd
