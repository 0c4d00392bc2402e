#include "sim/excitation/recipe_ranges.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>

#include "sim/excitation/recipe.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

const std::filesystem::path recipes = NBD_ASSETS "/recipes";

std::string text_of(const std::filesystem::path& path) {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
}

/// Collects the paths of all keys of an object and of its nested objects.
void collect_keys(const nlohmann::json& object, const std::string& path, std::set<std::string>& keys) {
    for (const auto& [key, value] : object.items()) {
        keys.insert(path + key);
        if (value.is_object()) collect_keys(value, path + key + ".", keys);
    }
}

/// Collects the paths of all keys that a JSON schema allows.
void collect_properties(const nlohmann::json& schema, const std::string& path, std::set<std::string>& keys) {
    EXPECT_EQ(schema["additionalProperties"], false) << path;
    for (const auto& [key, property] : schema["properties"].items()) {
        keys.insert(path + key);
        if (property.contains("properties")) collect_properties(property, path + key + ".", keys);
    }
}

/// Builds an object from the defaults of a JSON schema.
nlohmann::json defaults_of(const nlohmann::json& schema) {
    nlohmann::json object;
    for (const auto& [key, property] : schema["properties"].items()) {
        if (property.contains("properties")) object[key] = defaults_of(property);
        if (property.contains("default")) object[key] = property["default"];
    }
    return object;
}

TEST(RecipeRanges, DefaultFileAndSchemaAgreeWithTheProgram) {
    EXPECT_EQ(parse_recipe_ranges("{}"), RecipeRanges{});
    EXPECT_EQ(parse_recipe_ranges(text_of(recipes / "default.json")), RecipeRanges{});
    const auto schema = nlohmann::json::parse(text_of(recipes / "recipe.schema.json"));
    EXPECT_EQ(defaults_of(schema), nlohmann::json::parse(to_json({})));

    RecipeRanges all;
    all.contact_share = 0.5;
    std::set<std::string> written, allowed;
    collect_keys(nlohmann::json::parse(to_json(all)), "", written);
    collect_properties(schema, "", allowed);
    written.insert("$schema");
    EXPECT_EQ(written, allowed);
}

TEST(RecipeRanges, ExamplesRoundTrip) {
    int examples = 0;
    for (const auto& entry : std::filesystem::directory_iterator(recipes)) {
        if (entry.path().filename() == "recipe.schema.json") continue;
        const RecipeRanges ranges = parse_recipe_ranges(text_of(entry.path()));
        EXPECT_EQ(parse_recipe_ranges(to_json(ranges)), ranges) << entry.path();
        ++examples;
    }
    EXPECT_GE(examples, 3);
}

TEST(RecipeRanges, MixFollowsWeightsAndContactShare) {
    const auto mix = [](const char* text) { return recipe_mix(parse_recipe_ranges(text)); };
    for (std::size_t k = 0; k < 5; ++k) EXPECT_DOUBLE_EQ(mix("{}")[k], 0.2);
    for (std::size_t k = 5; k < recipe_kinds; ++k) EXPECT_EQ(mix("{}")[k], 0);
    const auto weighted = mix(R"({"kinds": {"free": {"weight": 6}, "drop": {"weight": 0}}})");
    EXPECT_EQ(weighted[0], 0);
    EXPECT_DOUBLE_EQ(weighted[4], 6 / 9.);
    const auto touching = mix(R"({"contact_share": 0.9, "kinds": {"drop": {"weight": 2}}})");
    EXPECT_DOUBLE_EQ(touching[0], 0.6);
    EXPECT_DOUBLE_EQ(touching[3], 0.3);
    EXPECT_NEAR(std::accumulate(touching.begin(), touching.end(), 0.0), 1, 1e-12);
}

TEST(RecipeRanges, ErrorsNameThePathAndTheAllowedRange) {
    const auto error = [](const char* text) { return test::refusal([&] { parse_recipe_ranges(text); }); };
    EXPECT_EQ(error(R"({"stregth": 2})"),
              R"(recipe: unknown key "stregth"; the nearest known one is "strength")");
    EXPECT_EQ(error(R"({"force": {"strian": {}}})"),
              R"(recipe.force: unknown key "strian"; the nearest known one is "strain")");
    EXPECT_EQ(error(R"({"force": {"strain": [1, 2]}})"), "recipe.force.strain: must be an object, not [1,2]");
    EXPECT_EQ(error(R"({"kinds": {"drop": {"weight": "often"}}})"),
              R"(recipe.kinds.drop.weight: must be a number, not "often")");
    EXPECT_EQ(error(R"({"kinds": {"drop": {"weight": -1}}})"),
              "recipe.kinds.drop.weight: is -1, but must be from 0 to 1e6");
    EXPECT_EQ(error(R"({"hands": {"twist": {"from": 2}}})"),
              "recipe.hands.twist: goes from 2 to 0.9, but must not decrease");
    EXPECT_EQ(error(R"({"contact_share": 1.5})"), "recipe.contact_share: is 1.5, but must be from 0 to 1");
    EXPECT_EQ(error(R"({"contact_share": 1, "kinds": {"drop": {"weight": 0}, "thrown": {"weight": 0}}})"),
              "recipe.contact_share: is 1, but the weights of drop, thrown and squash are 0");
    EXPECT_EQ(error("[]").rfind("recipe: must be an object", 0), 0u);
    EXPECT_EQ(error("{").rfind("line 1, column 2", 0), 0u);
}

double sturdiness(const Eigen::Vector3d& size, const Eigen::Vector3i& cells, const Material& material = {}) {
    const Body body = test::box_body(size, cells, material);
    return natural_scales(body, LocalThickness(body.tets)).sturdiness;
}

TEST(LocalThickness, IsTheDiameterOfARodAndTwiceTheThicknessOfAPlate) {
    const LocalThickness rod(test::box_body({4, 0.1, 0.1}, {80, 2, 2}).tets);
    EXPECT_NEAR(rod.at({0, 0, 0}, 0.5), 0.1, 0.01);
    const LocalThickness plate(test::box_body({2, 2, 0.05}, {40, 40, 1}).tets);
    EXPECT_NEAR(plate.at({0, 0, 0}, 0.5), 0.1, 0.01);
    EXPECT_NEAR(plate.volume({0, 0, 0}, 0.5), 3.14 * 0.25 * 0.05, 0.003);
    EXPECT_TRUE(std::isinf(LocalThickness(test::box_body({1, 1, 1}, {8, 8, 8}).tets).at({0, 0, 0}, 0.2)));
}

TEST(Sturdiness, DependsOnlyOnTheRelativeThicknessOfLimbs) {
    EXPECT_EQ(sturdiness({1, 1, 1}, {4, 4, 4}), 1);
    EXPECT_EQ(sturdiness({1, 0.3, 0.25}, {6, 2, 2}), 1);
    const double thin = sturdiness({1, 0.05, 0.05}, {40, 2, 2});
    const double thinner = sturdiness({1, 0.025, 0.025}, {80, 2, 2});
    EXPECT_NEAR(thin, 0.5, 0.1);
    EXPECT_NEAR(thinner, thin / 2, 0.05);
    EXPECT_NEAR(sturdiness({100, 5, 5}, {40, 2, 2}, {.young = 1e9, .density = 7800}), thin, 1e-9);
}

}  // namespace
}  // namespace nbd
