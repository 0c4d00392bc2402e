#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "collision/query/closest_query.hpp"
#include "collision/query/many_body_query.hpp"
#include "collision/query/pair_query.hpp"
#include "tests/collision/wide_tree/hung_surface.hpp"
#include "tests/support/brute_force.hpp"

namespace nbd {
namespace {

using test::HungSurface;

/// Two bodies that overlap somehow, in a wild pose each.
struct Scene {
    Vertices nodes_a, nodes_b, a, b;

    Scene(const HungSurface& s, const HungSurface& t, int kind, std::mt19937& random)
        : nodes_a(test::wild_pose(s.rest, kind, random)), nodes_b(test::wild_pose(t.rest, kind, random)) {
        const float reach = 0.3f * (nodes_a.colwise().maxCoeff() - nodes_a.colwise().minCoeff()).norm();
        nodes_b.rowwise() += nodes_a.colwise().mean() - nodes_b.colwise().mean();
        nodes_b.rowwise() += reach * shapes::uniform3(random).transpose();
        a = embedded(s.W, nodes_a);
        b = embedded(t.W, nodes_b);
    }
};

struct HungPair {
    HungSurface a, b;
};
std::vector<HungPair> pairs_of_bodies() {
    return {{test::hung_on_tets(shapes::torus(24, 12), 3), test::hung_on_tets(shapes::bar(20, 14), 5)},
            {test::hung_on_lattice(shapes::sphere(14, 20), 2), test::hung_on_itself(shapes::torus(20, 14))},
            {test::hung_on_itself(shapes::sphere(3, 4)), test::hung_on_lattice(shapes::torus(40, 30), 6)}};
}

TEST(AffineQuery, AgreesWithBruteForceInWildPoses) {
    std::mt19937 random(1);
    PairQuery query;
    ClosestQuery closest;
    std::size_t found = 0, near = 0;
    int apart = 0;
    for (const HungPair& pair : pairs_of_bodies()) {
        PosedTree a(test::hung_tree(pair.a), BoundKind::affine),
            b(test::hung_tree(pair.b), BoundKind::affine);
        for (int kind = 0; kind < test::wild_poses; ++kind) {
            const Scene scene(pair.a, pair.b, kind, random);
            a.begin_pose_of_nodes(scene.nodes_a);
            b.begin_pose_of_nodes(scene.nodes_b);
            const Faces &fa = pair.a.surface.F, &fb = pair.b.surface.F;
            const auto expected = test::brute_force_intersecting(scene.a, fa, scene.b, fb);
            EXPECT_EQ(test::listed(query.intersecting(a, b)), expected) << "pose " << kind;
            EXPECT_EQ(query.counters().face_pairs, static_cast<long>(expected.size()));
            found += expected.size();
            const float distance =
                0.01f * (scene.a.colwise().maxCoeff() - scene.a.colwise().minCoeff()).norm();
            const auto within = test::brute_force_within(scene.a, fa, scene.b, fb, distance);
            EXPECT_EQ(test::listed(query.within(a, b, distance)), within) << "pose " << kind;
            EXPECT_TRUE(std::ranges::includes(test::sorted(query.boxes_within(a, b, distance)), within));
            near += within.size();
            const auto nearest = closest.closest(a, b);
            ASSERT_TRUE(nearest);
            const auto truth = test::brute_force_closest(scene.a, fa, scene.b, fb);
            EXPECT_NEAR(nearest->points.distance, truth.distance, 1e-12 * (1 + scene.a.norm()))
                << "pose " << kind;
            if (truth.distance > 0) {
                EXPECT_EQ(nearest->faces, truth.faces);
                ++apart;
            }
        }
    }
    EXPECT_GT(found, 1000u);
    EXPECT_GT(near, 2 * found);
    EXPECT_GT(apart, 5);
}

TEST(AffineQuery, FindsAllPairsWhereNumbersOverflow) {
    const HungSurface hung = test::hung_on_lattice(shapes::torus(40, 30), 6);
    PosedTree a(test::hung_tree(hung), BoundKind::affine), b(test::hung_tree(hung), BoundKind::affine);
    PairQuery query;
    Vertices nodes_b = hung.rest;
    nodes_b.rowwise() += Eigen::RowVector3f(0.3f, 0.2f, 0.1f);
    const Vertices x_b = embedded(hung.W, nodes_b);
    b.begin_pose_of_nodes(nodes_b);
    std::size_t found = 0;
    for (const float far : {1e30f, 1e34f, 1e36f, 3e37f})
        for (int node = 0; node < hung.rest.rows(); node += 23) {
            Vertices nodes = hung.rest;
            nodes(node, node % 3) = far;
            a.begin_pose_of_nodes(nodes);
            const auto expected =
                test::brute_force_intersecting(embedded(hung.W, nodes), hung.surface.F, x_b, hung.surface.F);
            ASSERT_EQ(test::listed(query.intersecting(a, b)), expected) << "node " << node << " at " << far;
            found += expected.size();
        }
    EXPECT_GT(found, 1000u);
}

TEST(AffineQuery, FindsFacesWithinADistanceOfLines) {
    // Normals of such thin boxes are so short that their squares underflow.
    const HungSurface hung = test::hung_on_tets(shapes::bar(20, 14), 5);
    PosedTree a(test::hung_tree(hung), BoundKind::affine), b(test::hung_tree(hung), BoundKind::affine);
    PairQuery query;
    for (const float thickness : {1e-15f, 1e-17f, 1e-18f, 3e-19f, 1e-19f, 3e-20f, 1e-20f, 1e-21f, 1e-23f}) {
        Vertices nodes = hung.rest;
        nodes.rightCols<2>() *= thickness;
        Vertices nodes_b = nodes;
        nodes_b.col(1).array() += 0.1f;
        a.begin_pose_of_nodes(nodes);
        b.begin_pose_of_nodes(nodes_b);
        const auto expected = test::brute_force_within(embedded(hung.W, nodes), hung.surface.F,
                                                       embedded(hung.W, nodes_b), hung.surface.F, 0.101f);
        EXPECT_GT(expected.size(), 100u);
        EXPECT_EQ(test::listed(query.within(a, b, 0.101f)), expected) << thickness;
    }
}

TEST(AffineQuery, PartsObliqueSheets) {
    // Boxes along the axes of sheets that lie in parallel at a slant overlap; `boxes` have no others.
    const HungSurface hung = test::hung_on_tets(shapes::torus(80, 60), 4);
    Vertices sheet = hung.rest;
    sheet.col(2) *= 0.01f;
    sheet *= Eigen::AngleAxisf(0.8f, Eigen::Vector3f(1, 0.7f, 0).normalized()).matrix();
    const Eigen::RowVector3f normal =
        Eigen::RowVector3f::UnitZ() *
        Eigen::AngleAxisf(0.8f, Eigen::Vector3f(1, 0.7f, 0).normalized()).matrix();
    PairQuery query;
    const auto leaf_pairs = [&](BoundKind kind) {
        PosedTree a(test::hung_tree(hung), kind), b(test::hung_tree(hung), kind);
        Vertices x_a, x_b;
        const Vertices other = sheet.rowwise() + 0.05f * normal;
        if (kind == BoundKind::affine) {
            a.begin_pose_of_nodes(sheet);
            b.begin_pose_of_nodes(other);
        } else {
            a.begin_pose(x_a = embedded(hung.W, sheet));
            b.begin_pose(x_b = embedded(hung.W, other));
        }
        EXPECT_TRUE(query.intersecting(a, b).empty());
        return query.counters().leaf_pairs;
    };
    EXPECT_GT(leaf_pairs(BoundKind::boxes), 1000);
    EXPECT_LT(leaf_pairs(BoundKind::affine), 20);
}

TEST(AffineQuery, FindsFacesWithinADistanceOfBodiesWhoseBoxesAreApart) {
    const HungSurface torus = test::hung_on_tets(shapes::torus(24, 12), 3);
    PosedTree a(test::hung_tree(torus), BoundKind::affine), b(test::hung_tree(torus), BoundKind::affine);
    const Eigen::RowVector3f side(torus.rest.col(0).maxCoeff() - torus.rest.col(0).minCoeff() + 0.05f, 0, 0);
    const Vertices moved = torus.rest.rowwise() + side, x = embedded(torus.W, torus.rest),
                   y = embedded(torus.W, moved);
    a.begin_pose_of_nodes(torus.rest);
    b.begin_pose_of_nodes(moved);
    ASSERT_LT(a.whole().hi[0], b.whole().lo[0]);
    const auto gap =
        static_cast<float>(test::brute_force_closest(x, torus.surface.F, y, torus.surface.F).distance);
    const auto expected = test::brute_force_within(x, torus.surface.F, y, torus.surface.F, 1.2f * gap);
    EXPECT_FALSE(expected.empty());
    EXPECT_EQ(test::listed(PairQuery().within(a, b, 1.2f * gap)), expected);
    EXPECT_TRUE(PairQuery().within(a, b, 0.9f * gap).empty());
}

TEST(AffineQuery, AsksManyBodies) {
    std::mt19937 random(3);
    const HungSurface s = test::hung_on_tets(shapes::torus(16, 10), 3);
    const auto tree = test::hung_tree(s);
    constexpr int count = 6;
    std::vector<Vertices> nodes, x;
    std::vector<PosedTree> trees;
    std::vector<PosedTree*> bodies;
    for (int i = 0; i < count; ++i) {
        nodes.push_back(shapes::moved(s.rest, shapes::random_motion(random, 0.6f)));
        x.push_back(embedded(s.W, nodes.back()));
        trees.emplace_back(tree, BoundKind::affine);
    }
    for (int i = 0; i < count; ++i) {
        trees[i].begin_pose_of_nodes(nodes[i]);
        bodies.push_back(&trees[i]);
    }
    ManyBodyQuery query;
    std::size_t touching = 0;
    const auto found = query.intersecting(bodies);
    auto next = found.begin();
    for (std::size_t a = 0; a < count; ++a)
        for (std::size_t b = a + 1; b < count; ++b) {
            const auto expected = test::brute_force_intersecting(x[a], s.surface.F, x[b], s.surface.F);
            if (expected.empty()) continue;
            ++touching;
            ASSERT_NE(next, found.end());
            EXPECT_EQ(test::listed(next->faces), expected);
            ++next;
        }
    EXPECT_EQ(next, found.end());
    EXPECT_GT(touching, 3u);
}

TEST(AffineQuery, TakesAPoseOfPositionsToo) {
    const HungSurface s = test::hung_on_tets(shapes::torus(24, 12), 3);
    PosedTree a(test::hung_tree(s), BoundKind::affine), b(test::hung_tree(s), BoundKind::affine);
    const Vertices x = s.surface.X.rowwise() + Eigen::RowVector3f(0.3f, 0.1f, 0);
    PairQuery query;
    const auto expected = test::brute_force_intersecting(x, s.surface.F, s.surface.X, s.surface.F);
    ASSERT_GT(expected.size(), 10u);
    for (int round = 0; round < 2; ++round) {
        a.begin_pose(x);
        b.begin_pose_of_nodes(s.rest);
        EXPECT_EQ(test::listed(query.intersecting(a, b)), expected);
        const Vertices nodes = s.rest.rowwise() + Eigen::RowVector3f(0, 0, 5);
        a.begin_pose_of_nodes(nodes);
        EXPECT_TRUE(query.intersecting(a, b).empty());
    }
}

TEST(AffineQuery, KnowsTheModelOfAnotherSurface) {
    const HungSurface s = test::hung_on_tets(shapes::torus(16, 10), 3);
    CollisionTree tree = make_exact_tree(s.surface.X, s.surface.F);
    hang_on_nodes(tree, s.W, s.rest);
    tree.faces.row(3).reverseInPlace();
    EXPECT_THROW(check_collision_tree(tree), std::invalid_argument);
}

TEST(AffineQuery, HandlesOneFaceAndUnusedVertices) {
    shapes::Surface surface;
    surface.X = Vertices::Random(5, 3);
    surface.F.resize(1, 3);
    surface.F << 4, 1, 2;
    const HungSurface one = test::hung_on_itself(surface),
                      other = test::hung_on_tets(shapes::torus(16, 10), 2);
    PosedTree a(test::hung_tree(one), BoundKind::affine), b(test::hung_tree(other), BoundKind::affine);
    a.begin_pose_of_nodes(one.rest);
    b.begin_pose_of_nodes(other.rest);
    PairQuery query;
    EXPECT_EQ(test::listed(query.intersecting(a, b)),
              test::brute_force_intersecting(one.surface.X, one.surface.F, other.surface.X, other.surface.F));
    EXPECT_EQ(test::listed(query.within(a, b, 1e30f)).size(),
              static_cast<std::size_t>(other.surface.F.rows()));
}

}  // namespace
}  // namespace nbd
