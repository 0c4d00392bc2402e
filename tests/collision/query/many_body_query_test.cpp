#include "collision/query/many_body_query.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <memory>
#include <random>
#include <thread>

#include "tests/collision/models.hpp"

namespace nbd {
namespace {

/// Threads in whatever order the operating system schedules them.
Executor threads(int count) {
    return [count](int tasks, const std::function<void(int)>& task) {
        std::atomic<int> next{0};
        std::vector<std::jthread> workers;
        for (int i = 0; i < count; ++i)
            workers.emplace_back([&] {
                for (int k = next++; k < tasks; k = next++) task(k);
            });
    };
}

struct Answer {
    BodyIndices bodies;
    std::vector<FacePair> faces;
    bool operator==(const Answer&) const = default;
};

std::vector<Answer> copied(std::span<const TouchingBodies> answers) {
    std::vector<Answer> result;
    for (const TouchingBodies& answer : answers)
        result.push_back({answer.bodies, {answer.faces.begin(), answer.faces.end()}});
    return result;
}

/// Eighteen overlapping tori in one pose.
class ManyBodies : public ::testing::TestWithParam<BoundKind> {
 protected:
    ManyBodies() {
        const shapes::Surface torus = shapes::torus(14, 8);
        const auto tree = shapes::shared_full_tree(torus, 6, 40, 1);
        std::mt19937 random(6);
        for (int i = 0; i < 18; ++i) {
            x_.push_back(
                shapes::moved(shapes::wobbled(torus.X, random, 0.05f), shapes::random_motion(random, 1.6f)));
            trees_.emplace_back(tree, GetParam());
        }
        for (PosedTree& body : trees_) bodies_.push_back(&body);
        begin_poses();
    }

    void begin_poses() {
        for (std::size_t i = 0; i < trees_.size(); ++i) trees_[i].begin_pose(x_[i]);
    }

    std::vector<Vertices> x_;
    std::vector<PosedTree> trees_;
    std::vector<PosedTree*> bodies_;
};

TEST_P(ManyBodies, GetTheSameAnswersAsPairwiseQueries) {
    PairQuery query;
    std::vector<Answer> expected;
    for (int a = 0; a < 18; ++a)
        for (int b = a + 1; b < 18; ++b) {
            const auto faces = query.within(trees_[a], trees_[b], 0.05f);
            if (!faces.empty()) expected.push_back({{a, b}, {faces.begin(), faces.end()}});
        }
    ManyBodyQuery many;
    EXPECT_EQ(copied(many.within(bodies_, 0.05f)), expected);
    EXPECT_GE(expected.size(), 10u);
    EXPECT_GE(many.pairs_asked(), static_cast<int>(expected.size()));
    EXPECT_LT(many.pairs_asked(), 18 * 17 / 2);
    EXPECT_LT(many.rounds(), many.pairs_asked());
}

TEST_P(ManyBodies, GetTheSameAnswersOnAnyNumberOfThreads) {
    ManyBodyQuery one;
    const std::vector<Answer> expected = copied(one.intersecting(bodies_));
    ASSERT_GE(expected.size(), 8u);
    for (const int count : {2, 5}) {
        ManyBodyQuery many(threads(count));
        for (int again = 0; again < 3; ++again) {
            begin_poses();
            EXPECT_EQ(copied(many.intersecting(bodies_)), expected) << count << " threads";
        }
    }
}

TEST_P(ManyBodies, AreBoundedOncePerPoseForAllPairs) {
    ManyBodyQuery many;
    many.within(bodies_, 0.05f);
    std::vector<int> bounded;
    for (const PosedTree& body : trees_) bounded.push_back(body.nodes_bounded());
    many.within(bodies_, 0.05f);
    for (std::size_t i = 0; i < trees_.size(); ++i) EXPECT_EQ(trees_[i].nodes_bounded(), bounded[i]);
}

INSTANTIATE_TEST_SUITE_P(AllBounds, ManyBodies,
                         ::testing::Values(BoundKind::exact, BoundKind::boxes, BoundKind::bd, BoundKind::nbd,
                                           BoundKind::learned_affine),
                         [](const auto& info) { return std::string(name(info.param)); });

TEST(ManyBodyQuery, FindsBesideBoxesWhatSpheresOfTheRootMiss) {
    const shapes::Surface torus = shapes::torus(14, 8);
    CollisionTree made = shapes::full_tree(torus, shapes::make_modes(torus, 6, 40, 1));
    made.nbd->out_centre.row(0).setConstant(100);  // spheres far from the body
    const auto tree = std::make_shared<const CollisionTree>(std::move(made));
    const Vertices y = torus.X.rowwise() + Eigen::RowVector3f(0.5f, 0.4f, 0.3f),
                   far = torus.X.rowwise() + Eigen::RowVector3f(0, 0, 30);
    PosedTree a(tree, BoundKind::nbd), b(tree, BoundKind::boxes), c(tree, BoundKind::nbd);
    PosedTree* bodies[] = {&a, &b, &c};
    a.begin_pose(torus.X);
    b.begin_pose(y);
    c.begin_pose(far);
    PairQuery query;
    const auto faces = query.intersecting(a, b);
    const std::vector<Answer> expected{{{0, 1}, {faces.begin(), faces.end()}}};
    ManyBodyQuery many;
    EXPECT_EQ(copied(many.intersecting(bodies)), expected);
    EXPECT_GT(expected[0].faces.size(), 10u);
    EXPECT_EQ(many.pairs_asked(), 1);
}

TEST(ManyBodyQuery, FindsBodiesThatReachTheLargestNumber) {
    const shapes::Surface torus = shapes::torus(12, 8);
    const auto tree = shared_exact_tree(torus.X, torus.F);
    PosedTree a(tree, BoundKind::boxes), b(tree, BoundKind::boxes);
    const Vertices x = torus.X / torus.X.cwiseAbs().maxCoeff() * std::numeric_limits<float>::max();
    a.begin_pose(x);
    b.begin_pose(x);
    PosedTree* bodies[] = {&a, &b};
    EXPECT_EQ(ManyBodyQuery().boxes_within(bodies, 0).size(), 1u);
}

TEST(Sweep, AgreesWithBruteForce) {
    std::mt19937 random(3);
    const auto draw = [&](float least, float most) {
        return least + (most - least) * static_cast<float>(random() % 4096) / 4096;
    };
    std::size_t touching = 0, apart = 0;
    Sweep sweep;
    for (int round = 0; round < 20; ++round) {
        std::vector<Box> boxes;
        for (int i = 0; i < 40; ++i) {
            const Eigen::Array4f lo(draw(0, 4), draw(0, 1), draw(0, 2), 0);
            const Eigen::Array4f size(draw(0, 1), draw(0, 1), draw(0, 1), 0);
            boxes.push_back(i % 9 == 4 ? empty_box() : Box{lo, lo + size});
        }
        std::vector<BodyIndices> expected;
        for (int a = 0; a < 40; ++a)
            for (int b = a + 1; b < 40; ++b) {
                const Box &s = boxes[a], &t = boxes[b];
                const bool touch = a % 9 != 4 && b % 9 != 4 && (s.lo <= t.hi).all() && (t.lo <= s.hi).all();
                if (touch) expected.push_back({a, b});
                ++(touch ? touching : apart);
            }
        EXPECT_TRUE(std::ranges::equal(sweep.touching(boxes), expected));
    }
    EXPECT_GT(touching, 500u);
    EXPECT_GT(apart, 500u);
}

TEST(Sweep, CountsBoxesThatShareAFace) {
    const Box left{{0, 0, 0, 0}, {1, 1, 1, 0}}, right{{1, 0, 0, 0}, {2, 1, 1, 0}};
    Sweep sweep;
    const auto pairs = sweep.touching(std::vector{right, left});
    ASSERT_EQ(pairs.size(), 1u);
    EXPECT_EQ(pairs[0], (BodyIndices{0, 1}));
    EXPECT_TRUE(sweep.touching({}).empty());
}

}  // namespace
}  // namespace nbd
