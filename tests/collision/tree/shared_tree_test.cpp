#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "tests/collision/models.hpp"

namespace nbd {
namespace {

/// Answers of a single-threaded query to random poses.
std::vector<std::vector<FacePair>> answers(const std::shared_ptr<const CollisionTree>& tree, BoundKind kind,
                                           const std::vector<Vertices>& poses) {
    PosedTree a(tree, kind), b(tree, kind);
    PairQuery query;
    std::vector<std::vector<FacePair>> result;
    for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
        a.begin_pose(poses[i]);
        b.begin_pose(poses[i + 1]);
        const auto keep = [&](std::span<const FacePair> pairs) {
            result.emplace_back(pairs.begin(), pairs.end());
        };
        keep(query.intersecting(a, b));
        keep(query.within(a, b, 0.03f));
    }
    return result;
}

/// For the thread sanitizer: reports data that queries of one tree share.
TEST(SharedTree, GivesTheSameAnswersToThreadsWithTheirOwnQueries) {
    const shapes::Surface s = shapes::torus(24, 16);
    const auto tree = shapes::shared_full_tree(s, 12, 80, 1);
    std::mt19937 random(3);
    std::vector<Vertices> poses;
    for (int i = 0; i < 6; ++i)
        poses.push_back(
            shapes::moved(shapes::wobbled(s.X, random, 0.05f), shapes::random_motion(random, 0.3f)));
    for (const BoundKind kind : shapes::kinds_of(*tree)) {
        const auto expected = answers(tree, kind, poses);
        std::vector<std::vector<std::vector<FacePair>>> results(4);
        {
            std::vector<std::jthread> threads;
            for (auto& result : results) threads.emplace_back([&] { result = answers(tree, kind, poses); });
        }
        for (const auto& result : results) EXPECT_EQ(result, expected) << name(kind);
        std::size_t pairs = 0;
        for (const auto& answer : expected) pairs += answer.size();
        EXPECT_GT(pairs, 100u) << name(kind);
    }
}

}  // namespace
}  // namespace nbd
