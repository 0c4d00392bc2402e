#include "apps/dataset/hold_out.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/support/box_body.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

const std::string recipe =
    R"({"kind": "thrown", "speed": 2, "velocity": [3, 0, 4], "gradient": [[1, 0], [0, 2]],
    "forces": [{"force": [1, 0, 0], "node": 7}, {"force": [0, 6, 8]}], "none": [], "thrown": {"velocity": [0, 0, 1]}})";

std::optional<double> number(const std::string& parameter) {
    const auto value = recipe_parameter(recipe, parameter);
    return value && std::holds_alternative<double>(*value) ? std::optional(std::get<double>(*value))
                                                           : std::nullopt;
}

TEST(HoldOut, ReadsParametersOfRecipes) {
    EXPECT_EQ(std::get<std::string>(*recipe_parameter(recipe, "kind")), "thrown");
    EXPECT_EQ(number("speed"), 2);
    EXPECT_EQ(number("velocity"), 5);  // the norm
    EXPECT_NEAR(*number("gradient"), std::sqrt(5), 1e-12);
    EXPECT_EQ(number("forces.force"), 10);  // the largest
    EXPECT_EQ(number("thrown.velocity"), 1);
    for (const char* missing : {"none", "nothing", "velocity.x", "forces", "speed.more", "thrown"})
        EXPECT_FALSE(recipe_parameter(recipe, missing)) << missing;
    EXPECT_FALSE(recipe_parameter("no JSON", "kind"));
}

/// Ten trajectories of speeds 0 to 9; the last has none.
std::map<int, std::string> recipes() {
    std::map<int, std::string> all;
    for (int id = 0; id < 10; ++id)
        all[id] = nlohmann::json{{"speed", id}, {"kind", id % 3 == 0 ? "drop" : "free"}}.dump();
    all[10] = R"({"kind": "fold"})";
    return all;
}

std::vector<int> held_out(const std::string& rule) {
    return split_by_parameter(parse_hold_out(rule), recipes()).held_out;
}

TEST(HoldOut, DividesByNamesRangesAndShares) {
    EXPECT_EQ(held_out("kind=drop"), (std::vector{0, 3, 6, 9}));
    EXPECT_EQ(held_out("kind=drop,fold"), (std::vector{0, 3, 6, 9, 10}));
    EXPECT_EQ(held_out("speed=2..4.5"), (std::vector{2, 3, 4}));
    EXPECT_EQ(held_out("speed=8.."), (std::vector{8, 9}));
    EXPECT_EQ(held_out("speed=..1"), (std::vector{0, 1}));
    EXPECT_EQ(held_out("speed=top:0.3"), (std::vector{7, 8, 9}));
    EXPECT_EQ(held_out("speed=bottom:0.01"), (std::vector{0}));
    const DatasetSplit split = split_by_parameter(parse_hold_out("speed=top:0.3"), recipes());
    EXPECT_EQ(split.name, "parameter");
    EXPECT_EQ(split.train, (std::vector{0, 1, 2, 3, 4, 5, 6, 10}));
    EXPECT_EQ(
        nlohmann::json::parse(split.rule),
        nlohmann::json::parse(R"({"rule": "speed=top:0.3", "parameter": "speed", "from": 7.0, "to": null})"));
}

TEST(HoldOut, KeepsEqualValuesInOnePart) {
    std::map<int, std::string> equal;
    for (int id = 0; id < 10; ++id) equal[id] = nlohmann::json{{"speed", id / 4}}.dump();
    const DatasetSplit split = split_by_parameter(parse_hold_out("speed=top:0.3"), equal);
    EXPECT_EQ(split.held_out, (std::vector{4, 5, 6, 7, 8, 9}));
}

TEST(HoldOut, RefusesOtherRulesAndEmptyParts) {
    for (const char* text :
         {"", "kind", "kind=", "=drop", "kind=drop,", "kind=,drop", "speed=..", "speed=3..2", "speed=top:0",
          "speed=top:1", "speed=top:x", "speed=a..b", "speed=1..nan"})
        EXPECT_EQ(test::refusal([&] { parse_hold_out(text); }),
                  "hold-out rule \"" + std::string(text) +
                      "\"; allowed: PARAMETER=NAME,NAME or PARAMETER=FROM..TO or PARAMETER=top:SHARE or "
                      "PARAMETER=bottom:SHARE with a share between 0 and 1");
    EXPECT_EQ(test::refusal([] { held_out("kind=curl"); }),
              "hold-out rule \"kind=curl\" holds out 0 of 11 trajectories; allowed: some, but not all");
    EXPECT_EQ(test::refusal([] { held_out("weight=top:0.5"); }),
              "hold-out rule \"weight=top:0.5\" holds out 0 of 11 trajectories; allowed: some, but not all");
    EXPECT_EQ(test::refusal([] { held_out("kind=drop,free,fold"); }),
              "hold-out rule \"kind=drop,free,fold\" holds out 11 of 11 trajectories; allowed: some, but not "
              "all");
}

TEST(HoldOut, IsCheckedBeforeTheWorkBegins) {
    const Body body = test::box_body({1, 0.3, 0.25}, {4, 1, 1});
    DatasetPlan plan;
    EXPECT_EQ(test::refusal([&] { check_hold_out(plan, body); }), "");
    plan.hold_out = "velocity_gradient=top:0.25";
    EXPECT_EQ(test::refusal([&] { check_hold_out(plan, body); }), "");
    plan.hold_out = "kind=curl";
    EXPECT_NE(test::refusal([&] { check_hold_out(plan, body); }).find("holds out 0 of 40 trajectories"),
              std::string::npos);
}

/// Neither a trajectory nor a value of the held-out range is in both parts, whatever the rule.
TEST(HoldOut, LeaksNothing) {
    const Body body = test::box_body({1, 0.3, 0.25}, {4, 1, 1});
    const RecipeBook book(std::make_shared<const Body>(body), ExcitationConfig{});
    std::map<int, std::string> drawn;
    for (int i = 0; i < 60; ++i) drawn[i] = recipe_json(book.draw(i));
    for (const char* text : {"velocity_gradient=top:0.2", "velocity_gradient=bottom:0.3",
                             "forces.force=top:0.1", "kind=thrown,drop", "grips.duration=top:0.5"}) {
        const HoldOutRule rule = parse_hold_out(text);
        const DatasetSplit split = split_by_parameter(rule, drawn);
        std::vector<int> both;
        std::ranges::set_intersection(split.train, split.held_out, std::back_inserter(both));
        EXPECT_TRUE(both.empty()) << text;
        EXPECT_EQ(split.train.size() + split.held_out.size(), drawn.size()) << text;
        const auto limits = nlohmann::json::parse(split.rule);
        for (const int id : split.train) {
            const auto value = recipe_parameter(drawn[id], rule.parameter);
            if (!value) continue;
            if (const auto* name = std::get_if<std::string>(&*value)) {
                for (const auto& held : limits["names"]) EXPECT_NE(*name, held.get<std::string>()) << text;
            } else {
                const double x = std::get<double>(*value);
                EXPECT_TRUE((!limits["from"].is_null() && x < limits["from"]) ||
                            (!limits["to"].is_null() && x > limits["to"]))
                    << text << ' ' << x;
            }
        }
    }
}

}  // namespace
}  // namespace nbd
