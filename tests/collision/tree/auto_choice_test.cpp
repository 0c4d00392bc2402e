#include "collision/tree/auto_choice.hpp"

#include <gtest/gtest.h>

namespace nbd {
namespace {

constexpr AutoChoice::Trial boxes{.start_ns = 10000, .query_ns = 5000, .work = 50},
    learned{.start_ns = 10, .query_ns = 8000, .work = 400};

AutoChoice tried(const AutoChoice::Trial& of_boxes, const AutoChoice::Trial& of_learned) {
    AutoChoice choice;
    for (int i = 0; i < AutoChoice::first_trials; ++i) choice.take_trial(of_boxes, of_learned);
    return choice;
}

TEST(AutoChoice, TakesExactBoxesUntilItWasTried) {
    AutoChoice choice;
    for (int i = 0; i < AutoChoice::first_trials; ++i) {
        EXPECT_FALSE(i == 0 && learned_is_cheaper(choice, choice));
        EXPECT_TRUE(choice.is_trial_due()) << i;
        choice.take_trial(boxes, learned);
    }
    EXPECT_FALSE(choice.is_trial_due());
    EXPECT_TRUE(learned_is_cheaper(choice, choice));
}

TEST(AutoChoice, FollowsTheWorkOfPoses) {
    AutoChoice choice = tried(boxes, learned);
    choice.take_pose(0, 400);
    EXPECT_TRUE(learned_is_cheaper(choice, choice));
    // 100 ns per unit for boxes and 20 for learned ones, of which there are 8 for each of the others: with
    // much work the start of a pose no longer matters.
    choice.take_pose(0, 2000);
    EXPECT_DOUBLE_EQ(choice.learned.work, 800) << "a quarter of the way";
    EXPECT_TRUE(learned_is_cheaper(choice, choice)) << "one pose of many";
    for (int i = 0; i < 20; ++i) choice.take_pose(0, 4000);
    EXPECT_FALSE(learned_is_cheaper(choice, choice));
    EXPECT_NEAR(choice.boxes.of_next_pose(), 10000 + 100 * 500, 200);
    for (int i = 0; i < 20; ++i) choice.take_pose(20, 0);
    EXPECT_TRUE(learned_is_cheaper(choice, choice));
    EXPECT_NEAR(choice.learned.of_next_pose(), 10 + 20 * 160, 250);
}

TEST(AutoChoice, ExpectsTheWorkOfOneKindFromThatOfTheOther) {
    AutoChoice choice;
    choice.take_pose(0, 7);  // says nothing of the ratio
    choice.take_trial(boxes, learned);
    EXPECT_DOUBLE_EQ(choice.learned_per_boxes, 8);
    EXPECT_DOUBLE_EQ(choice.boxes.work, 50);
    EXPECT_DOUBLE_EQ(choice.learned.work, 400);
    AutoChoice::Trial less = learned;
    less.work = 200;
    choice.take_trial(boxes, less);
    EXPECT_DOUBLE_EQ(choice.learned_per_boxes, 7);
    for (int i = 0; i < 20; ++i) choice.take_trial(boxes, less);
    EXPECT_NEAR(choice.learned_per_boxes, 4, 0.02);
    for (int i = 0; i < 20; ++i) choice.take_pose(0, 100);
    EXPECT_NEAR(choice.boxes.work, 25, 0.2);
}

TEST(AutoChoice, TriesTheCheaperKindFirst) {
    const AutoChoice fresh, cheap_learned = tried(boxes, learned),
                            cheap_boxes = tried({.start_ns = 10, .query_ns = 100, .work = 50}, learned);
    EXPECT_TRUE(learned_goes_first(fresh, fresh));
    EXPECT_TRUE(learned_goes_first(cheap_learned, cheap_learned));
    EXPECT_FALSE(learned_goes_first(cheap_boxes, cheap_boxes));
    EXPECT_TRUE(learned_goes_first(cheap_boxes, fresh)) << "one body's prices are not known";
}

TEST(AutoChoice, AddsTheCostsOfTwoBodies) {
    const AutoChoice small = tried({.start_ns = 100, .query_ns = 5000, .work = 50}, learned);
    const AutoChoice large = tried({.start_ns = 1e6, .query_ns = 5000, .work = 50}, learned);
    EXPECT_FALSE(learned_is_cheaper(small, small));
    EXPECT_TRUE(learned_is_cheaper(small, large));
    EXPECT_TRUE(learned_is_cheaper(large, small));
}

TEST(AutoChoice, ForgetsAPriceThatTheProcessorSpoiled) {
    AutoChoice choice;
    choice.take_trial({.start_ns = 1e9, .query_ns = 1e9, .work = 50}, learned);
    choice.take_trial(boxes, learned);
    EXPECT_EQ(choice.boxes.start_ns, 10000);
    EXPECT_EQ(choice.boxes.work_ns, 100);
    choice.take_trial({.start_ns = 10000, .query_ns = 90, .work = 1}, learned);
    EXPECT_EQ(choice.boxes.work_ns, 100) << "too little work to tell";
    choice.take_trial({.start_ns = 10000, .query_ns = 60000, .work = 400}, learned);
    EXPECT_EQ(choice.boxes.work_ns, 150) << "much more work than before";
}

TEST(AutoChoice, SpendsASmallShareOfTheTimeOnTrials) {
    AutoChoice choice = tried(boxes, learned);
    double spent = 0;
    while (!choice.is_trial_due()) {
        choice.take_pose(0, learned.work);
        spent += choice.learned.of_next_pose();
        ASSERT_LT(spent, 1e9);
    }
    EXPECT_GT(spent * AutoChoice::share_of_trials,
              choice.boxes.of_next_pose() + choice.learned.of_next_pose() - 1);
    choice.take_trial(boxes, learned);
    EXPECT_FALSE(choice.is_trial_due());
}

}  // namespace
}  // namespace nbd
