#include "collision/geometry/embedded_positions.hpp"

#include <gtest/gtest.h>

#include "collision/query/pair_query.hpp"
#include "tests/collision/models.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

/// An embedded surface: vertex v lies halfway between nodes v and v + 1.
struct Embedded {
    explicit Embedded(int vertices) {
        for (int v = 0; v < vertices; ++v) {
            row_begin.push_back(2 * v);
            columns.insert(columns.end(), {v, v + 1});
            weights.insert(weights.end(), {0.5f, 0.5f});
        }
        row_begin.push_back(2 * vertices);
    }
    EmbeddedPositions make() const {
        return {row_begin, columns, weights, static_cast<int>(row_begin.size())};
    }
    std::vector<int> row_begin, columns;
    std::vector<float> weights;
};

TEST(EmbeddedPositions, AreComputedOnDemandOncePerPose) {
    EmbeddedPositions x = Embedded(10).make();
    EXPECT_EQ(x.vertex_count(), 10);
    Vertices nodes = Vertices::Random(11, 3);
    x.begin_pose(nodes);
    x.compute(std::vector<int>{4, 7, 4});
    EXPECT_EQ(x.computed(), 2);
    for (const int v : {4, 7}) EXPECT_TRUE(x.rows().row(v).isApprox((nodes.row(v) + nodes.row(v + 1)) / 2));
    nodes *= 2;
    x.begin_pose(nodes);
    EXPECT_EQ(x.computed(), 0);
    x.compute_all();
    EXPECT_EQ(x.computed(), 10);
    EXPECT_TRUE(x.rows().isApprox((nodes.topRows(10) + nodes.bottomRows(10)) / 2));
}

TEST(EmbeddedPositions, RejectInvalidRows) {
    const Embedded e(3);
    const auto error = [&](auto&& spoil) {
        Embedded bad = e;
        spoil(bad);
        return test::refusal([&] { bad.make(); });
    };
    const std::string rows =
        "the row offsets of an embedding must start at 0, ascend and end at its number of columns and "
        "weights; there are ";
    EXPECT_EQ(error([](Embedded& b) { b.row_begin[1] = 5; }), rows + "6 columns and 6 weights");
    EXPECT_EQ(error([](Embedded& b) { b.weights.pop_back(); }), rows + "6 columns and 5 weights");
    EXPECT_EQ(error([](Embedded& b) { b.columns[2] = 4; }),
              "an embedding refers to node 4, but the node count is 4");
    EXPECT_EQ(error([](Embedded& b) { b.columns[2] = -1; }),
              "an embedding refers to node -1, but the node count is 4");
}

/// Queries see the same positions, no matter when they are computed.
TEST(EmbeddedPositions, GiveTheSameFacePairsWithEveryKindOfBounds) {
    const shapes::Surface s = shapes::bar(12, 3, 0.25f);
    const int n = s.X.rows();
    const shapes::Modes modes = shapes::make_modes(s, 6, 20, 4);
    const auto tree = std::make_shared<const CollisionTree>(shapes::full_tree(s, modes));
    const Embedded e(n);
    // Nodes with the vertices as midpoints: each is twice the vertex minus the previous node.
    const auto nodes_of = [&](const Vertices& x) {
        Vertices nodes(n + 1, 3);
        nodes.row(0).setZero();
        for (int v = 0; v < n; ++v) nodes.row(v + 1) = 2 * x.row(v) - nodes.row(v);
        return nodes;
    };
    Vertices other = s.X;
    other.col(1).array() += 0.2f;
    const Vertices nodes_a = nodes_of(s.X), nodes_b = nodes_of(other);
    for (const BoundKind kind : bound_kinds) {
        if (!has_bounds(*tree, kind)) continue;
        EmbeddedPositions x = e.make(), y = e.make();
        x.begin_pose(nodes_a);
        y.begin_pose(nodes_b);
        EmbeddedPositions all_x = x, all_y = y;
        all_x.compute_all();
        all_y.compute_all();
        PosedTree a(tree, kind), b(tree, kind), eager_a(tree, kind), eager_b(tree, kind);
        a.begin_pose(x);
        b.begin_pose(y);
        eager_a.begin_pose(all_x.rows());
        eager_b.begin_pose(all_y.rows());
        PairQuery query, eager;
        const auto found = query.intersecting(a, b), expected = eager.intersecting(eager_a, eager_b);
        EXPECT_GT(expected.size(), 0u) << name(kind);
        EXPECT_TRUE(std::ranges::equal(found, expected)) << name(kind);
        if (kind != BoundKind::nbd) continue;
        // For distant bodies the representatives suffice.
        Vertices far = s.X;
        far.col(0).array() += 10.f;
        const Vertices nodes_far = nodes_of(far);
        x.begin_pose(nodes_a);
        y.begin_pose(nodes_far);
        a.begin_pose(x);
        b.begin_pose(y);
        EXPECT_EQ(query.intersecting(a, b).size(), 0u);
        EXPECT_GT(x.computed(), 0);
        EXPECT_LE(x.computed(), static_cast<long>(tree->nbd->modes.representatives.size()));
    }
}

}  // namespace
}  // namespace nbd
