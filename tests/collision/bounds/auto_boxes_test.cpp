#include "collision/bounds/learned/auto_boxes.hpp"

#include <gtest/gtest.h>

#include "tests/collision/models.hpp"

namespace nbd {
namespace {

class AutoBoxesTest : public ::testing::Test {
 protected:
    bool equal(const Box& s, const Box& t) const { return (s.lo == t.lo).all() && (s.hi == t.hi).all(); }

    shapes::Surface s = shapes::bar(40, 40, 0.1f);
    SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = 7});
    LearnedModel model = shapes::random_learned_model(tree, false, 3);
    NodeMargins margins{std::vector<float>(tree.nodes.size(), 0.f), {}};
};

TEST_F(AutoBoxesTest, UseLearnedBoxesForFewNodesAndExactBoxesAfterManyWereBounded) {
    AutoBoxes boxes(tree, &model, margins);
    LearnedBoxes learned(tree, model, margins);
    ExactBoxes exact(tree);
    learned.begin_pose(s.X);
    exact.begin_pose(s.X);
    const auto ask = [&](int nodes) {
        boxes.begin_pose(s.X);
        for (int i = 0; i < nodes; ++i)
            EXPECT_TRUE(equal(boxes.box(i), boxes.learned() ? learned.box(i) : exact.box(i))) << i;
        EXPECT_EQ(boxes.bounded(), nodes);
        return boxes.learned();
    };
    EXPECT_TRUE(ask(3));  // no cost is known before the first pose, so learned boxes win
    const int all = static_cast<int>(tree.nodes.size());
    EXPECT_TRUE(ask(all));
    EXPECT_FALSE(ask(all));
    EXPECT_FALSE(ask(3));
    EXPECT_TRUE(ask(3));
}

TEST_F(AutoBoxesTest, AreExactWithoutALearnedModel) {
    AutoBoxes boxes(tree, nullptr, margins);
    ExactBoxes exact(tree);
    exact.begin_pose(s.X);
    for (int pose = 0; pose < 3; ++pose) {
        boxes.begin_pose(s.X);
        EXPECT_TRUE(equal(boxes.box(5), exact.box(5)));
        EXPECT_FALSE(boxes.learned());
    }
}

}  // namespace
}  // namespace nbd
