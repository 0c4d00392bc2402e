#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "collision/geometry/box.hpp"
#include "collision/query/closest_query.hpp"
#include "collision/query/many_body_query.hpp"
#include "collision/query/pair_query.hpp"
#include "collision/query/self_query.hpp"
#include "tests/collision/models.hpp"
#include "tests/collision/wide_tree/hung_surface.hpp"
#include "tests/support/brute_force.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::HungSurface;

/// A body's nodes and surface at both ends of a step.
struct Step {
    const HungSurface* body;
    Vertices start_nodes, end_nodes, start, end;

    Step(const HungSurface& hung, Vertices nodes_at_start, Vertices nodes_at_end)
        : body(&hung),
          start_nodes(std::move(nodes_at_start)),
          end_nodes(std::move(nodes_at_end)),
          start(embedded(hung.W, start_nodes)),
          end(embedded(hung.W, end_nodes)) {}

    /// The hull of a face's boxes at both ends.
    Box box(int face) const {
        const Faces& F = body->surface.F;
        return joined(bounding_box(test::face_triangle(start, F, face)),
                      bounding_box(test::face_triangle(end, F, face)));
    }
    std::vector<Box> boxes() const {
        std::vector<Box> all;
        for (int f = 0; f < body->surface.F.rows(); ++f) all.push_back(box(f));
        return all;
    }
    Vertices at(float time) const { return start + time * (end - start); }
    void begin(PosedTree& tree) const {
        if (tree.kind() == BoundKind::affine)
            tree.begin_step_of_nodes(start_nodes, end_nodes);
        else
            tree.begin_step(start, end);
    }
};

std::vector<FacePair> near_boxes(const Step& s, const Step& t, float distance) {
    const std::vector<Box> boxes_s = s.boxes(), boxes_t = t.boxes();
    std::vector<FacePair> pairs;
    for (std::size_t a = 0; a < boxes_s.size(); ++a)
        for (std::size_t b = 0; b < boxes_t.size(); ++b)
            if (!apart(boxes_s[a], boxes_t[b], distance))
                pairs.push_back({static_cast<int>(a), static_cast<int>(b)});
    return pairs;
}

/// What a body's query with itself must find, of all pairs of its faces.
std::vector<FacePair> without_neighbours(std::vector<FacePair> pairs, const Faces& F) {
    std::erase_if(pairs, [&](const FacePair& pair) {
        bool share = pair.a >= pair.b;
        for (const int v : F.row(pair.a)) share |= (F.row(pair.b).array() == v).any();
        return share;
    });
    return pairs;
}

constexpr BoundKind conservative_kinds[] = {BoundKind::affine, BoundKind::boxes, BoundKind::exact,
                                            BoundKind::automatic};

/// From one wild pose to another one nearby.
Step wild_step(const HungSurface& hung, int kind, std::mt19937& random) {
    const Vertices start = test::wild_pose(hung.rest, kind, random),
                   other = test::wild_pose(hung.rest, kind + 1, random);
    const float size = (start.colwise().maxCoeff() - start.colwise().minCoeff()).norm();
    Vertices end = start + 0.1f * size / (1 + other.norm()) * other;
    end.rowwise() += 0.2f * size * shapes::uniform3(random).transpose();
    return {hung, start, end};
}

TEST(StepQuery, FindsTheFacesWhoseBoxesOverTheStepAreNear) {
    std::mt19937 random(1);
    PairQuery query;
    SelfQuery self;
    std::size_t found = 0, of_ends = 0, neighbours = 0;
    const HungSurface bodies[][2] = {
        {test::hung_on_tets(shapes::torus(24, 12), 3), test::hung_on_tets(shapes::bar(16, 10), 5)},
        {test::hung_on_lattice(shapes::sphere(12, 16), 2), test::hung_on_itself(shapes::torus(20, 14))}};
    for (const auto& [s, t] : bodies)
        for (int kind = 0; kind < test::wild_poses; ++kind) {
            const Step a = wild_step(s, kind, random);
            Step b = wild_step(t, kind, random);
            const Eigen::RowVector3f to = a.start_nodes.colwise().mean() - b.start_nodes.colwise().mean();
            b = Step(t, b.start_nodes.rowwise() + to, b.end_nodes.rowwise() + to);
            const float size = (a.start.colwise().maxCoeff() - a.start.colwise().minCoeff()).norm();
            for (const float distance : {0.f, 0.02f * size}) {
                const auto expected = near_boxes(a, b, distance);
                const auto expected_self = without_neighbours(near_boxes(a, a, distance), s.surface.F);
                found += expected.size();
                neighbours += expected_self.size();
                for (const BoundKind of_a : conservative_kinds) {
                    PosedTree tree_a(test::hung_tree(s), of_a),
                        tree_b(test::hung_tree(t), of_a == BoundKind::affine ? BoundKind::boxes : of_a);
                    a.begin(tree_a);
                    b.begin(tree_b);
                    const auto pairs = test::sorted(query.boxes_within(tree_a, tree_b, distance));
                    if (of_a == BoundKind::exact)  // spheres leave out some
                        EXPECT_TRUE(std::ranges::includes(expected, pairs)) << "pose " << kind;
                    else
                        EXPECT_EQ(pairs, expected) << name(of_a) << ", pose " << kind;
                    EXPECT_EQ(test::sorted(self.boxes_within(tree_a, distance)), expected_self)
                        << name(of_a) << ", pose " << kind;
                    tree_a.begin_pose(a.end);
                    tree_b.begin_pose(b.end);
                    of_ends += query.boxes_within(tree_a, tree_b, distance).size();
                }
            }
        }
    EXPECT_GT(found, 10000u);
    EXPECT_GT(neighbours, 10000u);
    EXPECT_LT(of_ends, 3 * found) << "of four kinds of bounds: steps have larger boxes";
}

TEST(StepQuery, LeavesOutNoFacesThatAreNearAtAnyTime) {
    std::mt19937 random(2);
    const HungSurface s = test::hung_on_tets(shapes::torus(24, 12), 3),
                      t = test::hung_on_tets(shapes::sphere(10, 12, 0.2f), 4);
    PairQuery query;
    constexpr float distance = 0.02f;
    std::size_t near = 0, missed_at_ends = 0;
    for (int step = 0; step < 4; ++step) {
        const auto placed = [&](const Vertices& rest) {
            return shapes::moved(shapes::wobbled(rest, random, 0.05f), shapes::random_motion(random, 0.5f));
        };
        const Step move_a(s, placed(s.rest), placed(s.rest)), move_b(t, placed(t.rest), placed(t.rest));
        std::vector<std::vector<FacePair>> found;
        for (const BoundKind kind : conservative_kinds) {
            PosedTree a(test::hung_tree(s), kind), b(test::hung_tree(t), kind);
            move_a.begin(a);
            move_b.begin(b);
            found.push_back(test::sorted(query.boxes_within(a, b, distance)));
        }
        std::vector<FacePair> at_ends;
        for (const int i : {0, 8, 1, 2, 3, 4, 5, 6, 7}) {
            // Times in between are rounded: a bit less than the distance stays within it.
            const float time = 0.125f * static_cast<float>(i),
                        less = i % 8 == 0 ? distance : 0.999f * distance;
            const auto now =
                test::brute_force_within(move_a.at(time), s.surface.F, move_b.at(time), t.surface.F, less);
            for (std::size_t k = 0; k < found.size(); ++k)
                EXPECT_TRUE(std::ranges::includes(found[k], now))
                    << name(conservative_kinds[k]) << ", step " << step << ", time " << time;
            near += now.size();
            if (i % 8 == 0) at_ends.insert(at_ends.end(), now.begin(), now.end());
            for (const FacePair& pair : now) missed_at_ends += std::ranges::count(at_ends, pair) == 0;
        }
    }
    EXPECT_GT(near, 300u);
    EXPECT_GT(missed_at_ends, near / 4) << "many are near in between alone";
}

TEST(StepQuery, FindsBodiesThatPassThroughEachOther) {
    const shapes::Surface ball = shapes::sphere(12, 16, 0.2f);
    const Vertices left = ball.X.rowwise() - Eigen::RowVector3f(2, 0, 0),
                   right = ball.X.rowwise() + Eigen::RowVector3f(2, 0, 0);
    const auto tree = shared_exact_tree(ball.X, ball.F);
    for (const auto& [kind, of_still] : {std::pair(BoundKind::boxes, BoundKind::boxes),
                                         {BoundKind::exact, BoundKind::boxes},
                                         {BoundKind::boxes, BoundKind::exact},
                                         {BoundKind::exact, BoundKind::exact}}) {
        PosedTree moving(tree, kind), still(tree, of_still);
        PairQuery query;
        still.begin_pose(ball.X);
        moving.begin_step(left, right);
        EXPECT_GT(query.boxes_within(moving, still, 0).size(), 1000u);
        EXPECT_EQ(query.boxes_within(moving, still, 0).size(), query.boxes_within(still, moving, 0).size());
        EXPECT_TRUE(query.intersecting(moving, still).empty()) << "it is past at the end";
        EXPECT_NEAR(ClosestQuery().closest(moving, still)->points.distance, 1.6, 0.01);
        const float lo = left.col(0).minCoeff(), hi = right.col(0).maxCoeff();
        EXPECT_NEAR(moving.whole().lo[0], lo, kind == BoundKind::exact ? 0.002 : 0);
        EXPECT_NEAR(moving.whole().hi[0], hi, kind == BoundKind::exact ? 0.002 : 0);
        EXPECT_LE(moving.whole().lo[0], lo);
        EXPECT_GE(moving.whole().hi[0], hi);

        ManyBodyQuery many;
        PosedTree* const bodies[] = {&moving, &still};
        ASSERT_EQ(many.boxes_within(bodies, 0).size(), 1u);
        EXPECT_EQ(many.boxes_within(bodies, 0)[0].faces.size(), query.boxes_within(moving, still, 0).size());
        moving.begin_pose(right);
        EXPECT_TRUE(many.boxes_within(bodies, 0).empty());
        EXPECT_TRUE(query.boxes_within(moving, still, 0).empty());
    }
}

TEST(StepQuery, TakesSpheresInAPoseForBoxesThatDoNotMove) {
    const shapes::Surface ball = shapes::sphere(12, 16, 0.2f);
    const auto tree = shared_exact_tree(ball.X, ball.F);
    PosedTree moving(tree, BoundKind::boxes), still(tree, BoundKind::exact), boxes(tree, BoundKind::boxes);
    const Vertices past = ball.X.rowwise() + Eigen::RowVector3f(2, 0, 0);
    moving.begin_step(ball.X, past);
    PairQuery query;
    EXPECT_TRUE(query.boxes_within(moving, still, 0).empty()) << "it has no pose";
    still.begin_pose(past);
    boxes.begin_pose(past);
    const auto expected = test::sorted(query.boxes_within(moving, boxes, 0));
    EXPECT_GT(expected.size(), 100u);
    EXPECT_EQ(test::sorted(query.boxes_within(moving, still, 0)), expected);
    EXPECT_EQ(query.boxes_within(still, moving, 0).size(), expected.size());
    still.begin_step(past, past);
    EXPECT_EQ(test::sorted(query.boxes_within(moving, still, 0)), expected);
}

TEST(StepQuery, SeesThePoseAtTheEndInAllOtherQueries) {
    std::mt19937 random(3);
    const shapes::Surface s = shapes::torus(40, 24);
    const auto tree = shapes::shared_full_tree(s, 20, 200, 1);
    const Vertices start = shapes::wobbled(s.X, random, 0.05f),
                   end = shapes::moved(start, shapes::random_motion(random, 0.3f)),
                   later = shapes::moved(start, shapes::random_motion(random, 0.3f));
    const auto expected = test::brute_force_intersecting(end, s.F, start, s.F);
    ASSERT_GT(expected.size(), 100u);
    for (const BoundKind kind : shapes::kinds_of(*tree)) {
        PosedTree a(tree, kind), b(tree, BoundKind::boxes), alike(tree, kind), other(tree, kind);
        PairQuery query;
        b.begin_pose(start);
        alike.begin_pose(start);
        for (int round = 0; round < 2; ++round) {
            a.begin_step(start, end);
            other.begin_pose(end);
            EXPECT_EQ(test::listed(query.intersecting(a, b)), expected) << name(kind);
            const auto beside_its_like = test::listed(query.intersecting(a, alike));
            if (can_miss(kind))
                EXPECT_TRUE(std::ranges::includes(expected, beside_its_like)) << name(kind);
            else
                EXPECT_EQ(beside_its_like, expected) << name(kind);
            a.begin_pose(later);
            other.begin_pose(later);
            if (!is_box(kind)) {
                EXPECT_EQ(a.sphere(3).c, other.sphere(3).c) << name(kind) << " after the step";
                EXPECT_EQ(a.nodes_bounded(), 1) << name(kind);
            }
            EXPECT_EQ(test::listed(query.intersecting(a, b)), test::listed(query.intersecting(other, b)))
                << name(kind);
            EXPECT_EQ(test::sorted(query.boxes_within(a, b, 0)),
                      test::sorted(query.boxes_within(other, b, 0)));
        }
    }
}

TEST(StepQuery, TakesNodesWithRoomBetweenRows) {
    const HungSurface hung = test::hung_on_tets(shapes::torus(24, 12), 3);
    Eigen::Matrix<float, Eigen::Dynamic, 8, Eigen::RowMajor> both(hung.rest.rows(), 8);
    both.setConstant(1e9f);
    both.leftCols<3>() = hung.rest;
    both.middleCols<3>(4) = hung.rest.rowwise() + Eigen::RowVector3f(0.2f, 0.1f, 0);
    PosedTree a(test::hung_tree(hung), BoundKind::affine), b(test::hung_tree(hung), BoundKind::affine);
    const Vertices start = both.leftCols<3>(), end = both.middleCols<3>(4);
    SelfQuery query;
    a.begin_step_of_nodes(VertexView(both.data(), both.rows(), 8),
                          VertexView(both.data() + 4, both.rows(), 8));
    b.begin_step_of_nodes(start, end);
    const auto expected = test::sorted(query.boxes_within(b, 0));
    EXPECT_EQ(test::sorted(query.boxes_within(a, 0)), expected);
    EXPECT_GT(expected.size(), 1000u);
}

}  // namespace
}  // namespace nbd
