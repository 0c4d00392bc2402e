#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "collision/query/closest_query.hpp"
#include "collision/query/many_body_query.hpp"
#include "collision/query/pair_query.hpp"
#include "tests/collision/bounds/affine/hung_surface.hpp"
#include "tests/collision/models.hpp"
#include "tests/support/brute_force.hpp"

namespace nbd {
namespace {

std::vector<FacePair> as_list(std::span<const FacePair> pairs) { return {pairs.begin(), pairs.end()}; }

/// A choice whose trials are over, with these prices of a pose.
AutoChoice priced(double boxes_ns, double learned_ns) {
    AutoChoice choice;
    for (int i = 0; i < AutoChoice::first_trials; ++i)
        choice.take_trial({.start_ns = boxes_ns, .query_ns = 1, .work = 1},
                          {.start_ns = learned_ns, .query_ns = 1, .work = 1});
    return choice;
}

struct AutoQuery : testing::Test {
    shapes::Surface s = shapes::torus(40, 24);
    CollisionTree full = shapes::full_tree(s, shapes::make_modes(s, 6, 40, 1), {.depth = 4});
    std::shared_ptr<const CollisionTree> sampled = std::make_shared<const CollisionTree>(full),
                                         learned = without_sampled_maps(full);
    std::mt19937 random{3};

    static std::shared_ptr<const CollisionTree> without_sampled_maps(CollisionTree tree) {
        tree.learned_affine.reset();
        tree.calibrations.erase(BoundKind::learned_affine);
        return std::make_shared<const CollisionTree>(std::move(tree));
    }

    Vertices pose(float apart) {
        Vertices x = shapes::moved(s.X, shapes::random_motion(random, 0.2f));
        return x.rowwise() + Eigen::RowVector3f(apart, 0, 0);
    }
};

TEST_F(AutoQuery, AnswersExactlyWhileItTries) {
    PosedTree a(learned, BoundKind::automatic), b(learned, BoundKind::automatic);
    PairQuery query;
    for (int i = 0; i < AutoChoice::first_trials; ++i) {
        const Vertices x = pose(0), y = pose(0.1f);
        a.begin_pose(x);
        b.begin_pose(y);
        EXPECT_EQ(a.auto_choice().trials, i);
        const auto found = as_list(query.intersecting(a, b));
        EXPECT_EQ(found, test::brute_force_intersecting(x, s.F, y, s.F));
        EXPECT_GT(found.size(), 10u);
        EXPECT_EQ(a.chosen(), BoundKind::boxes);
        PosedTree c(learned, BoundKind::boxes), d(learned, BoundKind::boxes);
        c.begin_pose(x);
        d.begin_pose(y);
        PairQuery exact;
        exact.intersecting(c, d);
        EXPECT_EQ(query.counters().nodes_bounded, exact.counters().nodes_bounded);
    }
    a.begin_pose(s.X);
    const AutoChoice choice = a.auto_choice();
    EXPECT_FALSE(choice.is_trial_due());
    for (const BoundsCost& cost : {choice.boxes, choice.learned}) {
        EXPECT_GT(cost.start_ns, 0);
        EXPECT_LT(cost.start_ns, 1e9);
        EXPECT_GT(cost.work_ns, 0);
        EXPECT_GT(cost.work, 0);
    }
}

TEST_F(AutoQuery, AnswersExactlyWhicheverKindItTriesFirst) {
    CollisionTree tree = *learned;
    for (BoxFit& box : tree.learned->boxes) box.growth = 0;
    for (auto& [kind, calibration] : tree.calibrations) std::ranges::fill(calibration.margins, 0.f);
    const auto missing = std::make_shared<const CollisionTree>(std::move(tree));
    AutoChoice due[] = {priced(1e9, 1), priced(1, 1e9)};
    EXPECT_TRUE(learned_goes_first(due[0], due[0]));
    EXPECT_FALSE(learned_goes_first(due[1], due[1]));
    std::size_t expected_pairs = 0, learned_pairs = 0;
    for (AutoChoice& choice : due)
        for (const float apart : {0.2f, 0.3f, 0.4f, 0.45f}) {
            choice.since_trial_ns = 1e12;
            PosedTree a(missing, BoundKind::automatic, 0.f), b(missing, BoundKind::automatic, 0.f),
                c(missing, BoundKind::learned_boxes, 0.f), d(missing, BoundKind::learned_boxes, 0.f);
            const Vertices x = pose(0), y = pose(apart);
            for (PosedTree* body : {&a, &b}) body->restore(choice);
            for (PosedTree* body : {&a, &c}) body->begin_pose(x);
            for (PosedTree* body : {&b, &d}) body->begin_pose(y);
            PairQuery query, other;
            const auto expected = test::brute_force_intersecting(x, s.F, y, s.F);
            EXPECT_EQ(as_list(query.intersecting(a, b)), expected);
            EXPECT_EQ(a.chosen(), BoundKind::boxes);
            a.begin_pose(x);
            EXPECT_EQ(a.auto_choice().trials, choice.trials + 1);
            expected_pairs += expected.size();
            learned_pairs += other.intersecting(c, d).size();
        }
    EXPECT_LT(learned_pairs, expected_pairs) << "a learned answer would not be noticed";
}

TEST_F(AutoQuery, CountsATrialWhateverStartsTheNextPose) {
    CollisionTree tree = full;
    SurfaceEmbedding W(s.X.rows(), s.X.rows());
    W.setIdentity();
    hang_on_nodes(tree, W, s.X);
    const auto hung = std::make_shared<const CollisionTree>(std::move(tree));
    const Vertices x = pose(0), y = pose(0.1f);
    const std::vector<std::function<void(PosedTree&)>> starts = {
        [&](PosedTree& body) { body.begin_pose(x); }, [&](PosedTree& body) { body.begin_pose_of_nodes(x); },
        [&](PosedTree& body) { body.begin_step(x, y); },
        [&](PosedTree& body) { body.begin_step_of_nodes(x, y); }};
    for (const auto& start : starts) {
        PosedTree a(hung, BoundKind::automatic), b(hung, BoundKind::automatic);
        a.begin_pose(x);
        b.begin_pose(y);
        EXPECT_FALSE(PairQuery().intersecting(a, b).empty());
        EXPECT_EQ(a.auto_choice().trials, 0);
        start(a);
        EXPECT_EQ(a.auto_choice().trials, 1);
        start(a);
        EXPECT_EQ(a.auto_choice().trials, 1);
    }
}

TEST_F(AutoQuery, DoesNotTryOnBodiesThatAreApart) {
    PosedTree a(learned, BoundKind::automatic), b(learned, BoundKind::automatic);
    PairQuery query;
    for (int i = 0; i < 3; ++i) {
        const Vertices x = pose(0), y = pose(50);
        a.begin_pose(x);
        b.begin_pose(y);
        EXPECT_TRUE(query.intersecting(a, b).empty());
    }
    a.begin_pose(s.X);
    EXPECT_EQ(a.auto_choice().trials, 0);
}

TEST_F(AutoQuery, UsesTheCheaperBounds) {
    const Vertices x = pose(0), y = pose(0.1f);
    for (const BoundKind kind : {BoundKind::boxes, BoundKind::learned_boxes, BoundKind::learned_affine}) {
        const auto& tree = kind == BoundKind::learned_affine ? sampled : learned;
        PosedTree a(tree, BoundKind::automatic), b(tree, BoundKind::automatic), c(tree, kind), d(tree, kind);
        for (PosedTree* body : {&a, &b})
            body->restore(kind == BoundKind::boxes ? priced(1, 1e9) : priced(1e9, 1));
        for (const auto& [body, positions] : {std::pair(&a, &x), {&b, &y}, {&c, &x}, {&d, &y}})
            body->begin_pose(*positions);
        PairQuery query, other;
        EXPECT_EQ(as_list(query.intersecting(a, b)), as_list(other.intersecting(c, d)));
        EXPECT_EQ(query.counters().nodes_bounded, other.counters().nodes_bounded);
        EXPECT_EQ(a.nodes_bounded() + b.nodes_bounded(), query.counters().nodes_bounded);
        EXPECT_EQ(a.chosen(), kind);
        EXPECT_EQ(ClosestQuery().closest(a, b)->faces, ClosestQuery().closest(c, d)->faces);
    }
}

TEST_F(AutoQuery, ChoosesAlikeAfterItsChoiceWasRestored) {
    PosedTree a(learned, BoundKind::automatic), b(learned, BoundKind::automatic),
        c(learned, BoundKind::automatic), d(learned, BoundKind::automatic);
    PairQuery query;
    const auto ask = [&](PosedTree& s_tree, PosedTree& t_tree, const Vertices& x, const Vertices& y) {
        s_tree.begin_pose(x);
        t_tree.begin_pose(y);
        query.intersecting(s_tree, t_tree);
        return std::pair(s_tree.chosen(), query.counters().nodes_bounded);
    };
    for (int i = 0; i < 2 * AutoChoice::first_trials; ++i) ask(a, b, pose(0), pose(0.1f));
    const Vertices x = pose(0), y = pose(0.1f);
    a.begin_pose(x);
    b.begin_pose(y);
    c.restore(a.auto_choice());
    d.restore(b.auto_choice());
    for (int i = 0; i < 20; ++i) {
        const Vertices u = pose(0), v = pose(0.04f * static_cast<float>(i));
        EXPECT_EQ(ask(a, b, u, v), ask(c, d, u, v)) << i;
    }
}

TEST_F(AutoQuery, MixesWithEveryKind) {
    const Vertices x = pose(0), y = pose(0.1f);
    const auto expected = test::brute_force_intersecting(x, s.F, y, s.F);
    for (const BoundKind kind : bound_kinds) {
        if (!has_bounds(*sampled, kind)) continue;
        PosedTree a(sampled, BoundKind::automatic), b(sampled, kind, can_miss(kind) ? 10.f : 0.f);
        a.begin_pose(x);
        b.begin_pose(y);
        PairQuery query;
        const auto found = as_list(query.intersecting(a, b));
        const bool exact = kind == BoundKind::boxes || kind == BoundKind::automatic;
        if (exact) {
            EXPECT_EQ(found, expected) << name(kind);
        }
        EXPECT_GT(found.size(), expected.size() / 2) << name(kind);
        const bool wide = exact || kind == BoundKind::learned_affine;
        EXPECT_EQ(a.chosen(), wide ? BoundKind::boxes : BoundKind::learned_boxes) << name(kind);
    }
}

TEST(AutoQueryWithoutLearnedBoxes, IsExact) {
    std::mt19937 random(5);
    const test::HungSurface s = test::hung_on_tets(shapes::torus(24, 12), 3);
    CollisionTree tree = make_exact_tree(s.surface.X, s.surface.F);
    const auto bare = std::make_shared<const CollisionTree>(tree);
    hang_on_nodes(tree, s.W, s.rest);
    const auto hung = std::make_shared<const CollisionTree>(std::move(tree));
    PosedTree a(bare, BoundKind::automatic), b(hung, BoundKind::automatic);
    PairQuery query;
    for (int i = 0; i < 4; ++i) {
        const Vertices x = shapes::moved(s.surface.X, shapes::random_motion(random, 0.2f)),
                       nodes = shapes::moved(s.rest, shapes::random_motion(random, 0.2f));
        Vertices y;
        apply_embedding(s.W, nodes, y);
        const auto expected = test::brute_force_intersecting(x, s.surface.F, y, s.surface.F);
        a.begin_pose(x);
        b.begin_pose_of_nodes(nodes);
        EXPECT_EQ(as_list(query.intersecting(a, b)), expected);
        EXPECT_EQ(a.chosen(), BoundKind::boxes);
        EXPECT_EQ(b.chosen(), BoundKind::affine);
        b.begin_pose(y);
        EXPECT_EQ(as_list(query.intersecting(a, b)), expected);
        EXPECT_EQ(b.chosen(), BoundKind::boxes);
        EXPECT_GT(expected.size(), 10u);
    }
    EXPECT_EQ(a.auto_choice().trials, 0);
}

}  // namespace
}  // namespace nbd
