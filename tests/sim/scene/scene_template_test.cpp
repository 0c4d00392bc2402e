// Scenes with variables: what is drawn, how it is put in, and what is refused.
#include "sim/scene/scene_template.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "tests/sim/scene/scene_text.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::with;

/// Text of a scene with these variables and further keys of its body.
std::string text_of(const std::string& variables, const std::string& in_body) {
    return with(in_body, R"("variables": [)" + variables + "]");
}

std::vector<std::string> problems_of(const std::string& variables, const std::string& in_body) {
    std::vector<std::string> problems;
    const SceneTemplate any(text_of(variables, in_body), "", problems);
    return problems;
}

SceneTemplate made(const std::string& variables, const std::string& in_body) {
    std::vector<std::string> problems;
    SceneTemplate result(text_of(variables, in_body), "", problems);
    EXPECT_EQ(problems, std::vector<std::string>());
    return result;
}

constexpr int draws = 4000;

TEST(SceneTemplate, DrawsByEachLaw) {
    const SceneTemplate scene = made(
        R"({"name": "x", "uniform": [-1, 3]}, {"name": "young", "log_uniform": [1e3, 1e7]},
           {"name": "count", "integer": [2, 4]}, {"name": "file", "choice": ["a.h5", "b.h5"]},
           {"name": "v", "direction": [0, 3, 4], "degrees": 60}, {"name": "turn", "rotation": "any"},
           {"name": "w", "uniform": [[0, -1, 5], [1, 1, 5]]})",
        R"("margin": {"var": "x"}, "material": {"young": {"var": "young"}, "density": {"var": "count"}},
           "tree": {"var": "file"}, "velocity": {"var": "v"}, "angular_velocity": {"var": "w"},
           "transform": {"rotate": {"var": "turn"}})");
    double x = 0, x2 = 0, log_young = 0, cosine = 0, least_cosine = 1, trace = 0;
    std::map<long long, int> counts;
    std::map<std::string, int> files;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (int i = 0; i < draws; ++i) {
        const SceneValues values = scene.draw(5, i);
        const double drawn = values["x"];
        x += drawn / draws;
        x2 += drawn * drawn / draws;
        log_young += std::log10(values["young"].get<double>()) / draws;
        ++counts[values["count"].get<long long>()];
        ++files[values["file"].get<std::string>()];
        const Eigen::Vector3d v(values["v"][0], values["v"][1], values["v"][2]);
        EXPECT_NEAR(v.norm(), 1, 1e-12);
        const double c = v.dot(Eigen::Vector3d(0, 0.6, 0.8));
        cosine += c / draws;
        least_cosine = std::min(least_cosine, c);
        mean += Eigen::Vector3d(values["w"][0], values["w"][1], values["w"][2]) / draws;
        trace += (1 + 2 * std::cos(values["turn"]["degrees"].get<double>() * std::numbers::pi / 180)) / draws;
    }
    EXPECT_NEAR(x, 1, 0.06);
    EXPECT_NEAR(x2 - x * x, 16.0 / 12, 0.06);
    EXPECT_NEAR(log_young, 5, 0.06);
    EXPECT_EQ(counts.size(), 3u);
    for (const auto& [count, times] : counts) EXPECT_NEAR(times, draws / 3.0, 100) << count;
    EXPECT_NEAR(files["a.h5"], draws / 2.0, 120);
    EXPECT_NEAR(cosine, 0.75, 0.01);  // uniform on a cap: the cosine is uniform in [0.5, 1]
    EXPECT_GE(least_cosine, 0.5 - 1e-12);
    EXPECT_LT(least_cosine, 0.51);
    EXPECT_LT((mean - Eigen::Vector3d(0.5, 0, 5)).norm(), 0.04);
    EXPECT_NEAR(trace, 0, 0.06);  // of rotations that are uniform over all
}

TEST(SceneTemplate, AValueDependsOnNameSeedAndNumbersAlone) {
    const std::string x = R"({"name": "x", "uniform": [0, 1]})", y = R"({"name": "y", "integer": [0, 1000]})";
    const std::string body = R"("margin": {"var": "x"}, "velocity": [0, 0, {"var": "y"}])";
    const SceneTemplate one = made(x + "," + y, body), other = made(y + "," + x, body),
                        alone = made(x, R"("margin": {"var": "x"})");
    EXPECT_EQ(one.draw(3, 7), other.draw(3, 7));
    EXPECT_EQ(one.draw(3, 7)["x"], alone.draw(3, 7)["x"]);
    std::set<double> values;
    for (const std::uint64_t seed : {3, 4})
        for (const int trajectory : {0, 1, 7})
            for (const int again : {0, 1, 2})
                values.insert(one.draw(seed, trajectory, again)["x"].get<double>());
    EXPECT_EQ(values.size(), 18u);
}

TEST(SceneTemplate, PutsValuesInWithTimesAndPlus) {
    const SceneTemplate scene = made(
        R"({"name": "s", "choice": [0.25]}, {"name": "n", "integer": [3, 3]}, {"name": "d", "uniform": [[1, 2, 3], [1, 2, 3]]})",
        R"("transform": {"scale": {"var": "s"}, "translate": [0, {"var": "n"}, {"var": "s", "times": -2, "plus": 3}]},
           "velocity": {"var": "d", "times": 2, "plus": [0, 0, 1]}, "name": "b", "margin": {"var": "s"})");
    const SceneSpec spec = scene.scene_with(scene.draw(1, 0));
    EXPECT_EQ(spec.bodies[0].placement.scale, 0.25);
    EXPECT_EQ(spec.bodies[0].placement.translate, Eigen::Vector3d(0, 3, 2.5));
    EXPECT_EQ(spec.bodies[0].velocity, Eigen::Vector3d(2, 4, 7));
    EXPECT_EQ(spec.text.find("var"), std::string::npos);
    const SceneTemplate whole = made(R"({"name": "n", "integer": [3, 3]})",
                                     R"("meshing": {"nodes": {"var": "n", "times": 2, "plus": 1}})");
    EXPECT_EQ(test::refusal([&] { whole.scene_with(whole.draw(1, 0)); }),
              "bodies[0].meshing: applies to surfaces and tetrahedra only; a body file is used unchanged");
}

TEST(SceneTemplate, NamesTheEndsOfItsRanges) {
    const SceneTemplate scene =
        made(R"({"name": "x", "uniform": [0, 1]}, {"name": "f", "choice": ["a", "b", "c"]})",
             R"("margin": {"var": "x"}, "name": {"var": "f"})");
    const std::vector<SceneValues> extremes = scene.extremes(1);
    ASSERT_EQ(extremes.size(), 5u);
    EXPECT_EQ(extremes[1]["x"], 1);
    EXPECT_EQ(extremes[1]["f"], scene.draw(1, 0)["f"]);
    EXPECT_EQ(extremes[4]["f"], "c");
}

TEST(SceneTemplate, SetsValuesByName) {
    const SceneTemplate scene =
        made(R"({"name": "x", "uniform": [0, 1]}, {"name": "f", "choice": ["a", "b"]})",
             R"("margin": {"var": "x"}, "name": {"var": "f"})");
    SceneValues values = scene.draw(1, 0);
    set_values(scene, {"x=0.125", "f=c.obj"}, values);
    EXPECT_EQ(values_text(values), R"(f "c.obj", x 0.125)");
    const auto refused = [&](const std::vector<std::string>& settings) {
        return test::refusal([&] { set_values(scene, settings, values); });
    };
    EXPECT_EQ(refused({"x"}), R"("x" is not NAME=VALUE)");
    EXPECT_EQ(refused({"y=1"}), R"("y" is no variable of the scene; allowed: x, f)");
    EXPECT_EQ(refused({"x=1", "x=2"}), R"("x" is set twice)");
}

TEST(SceneTemplate, RefusesWhatIsWrongInOneLine) {
    const std::string used = R"("margin": {"var": "x"})";
    const std::vector<std::pair<std::string, std::string>> cases{
        {R"({"name": "x", "uniform": [2, 1]})",
         "variables[0].uniform: is [2,1]; the first must not be above the second"},
        {R"({"name": "x", "uniform": [[0, 1, 0], [1, 0, 1]]})",
         "variables[0].uniform: is [[0,1,0],[1,0,1]]; the first must not be above the second"},
        {R"({"name": "x", "uniform": [1]})",
         "variables[0].uniform: must be [low, high], two numbers or two vectors of three, not [1]"},
        {R"({"name": "x", "log_uniform": [0, 1]})",
         "variables[0].log_uniform: is [0,1], but a logarithm needs numbers above 0"},
        {R"({"name": "x", "integer": [1, 2.5]})",
         "variables[0].integer: must be [low, high], two whole numbers within 1e12, not [1,2.5]"},
        {R"({"name": "x", "integer": [5, 2]})",
         "variables[0].integer: is [5,2]; the first must not be above the second"},
        {R"({"name": "x", "choice": []})",
         "variables[0].choice: must be a list of numbers or of texts, not []"},
        {R"({"name": "x", "choice": [1, "a"]})",
         R"(variables[0].choice: must be a list of numbers or of texts, not [1,"a"])"},
        {R"({"name": "x", "choice": [1, 2, 1]})", "variables[0].choice: has 1 twice"},
        {R"({"name": "x", "direction": [0, 0, 0]})", "variables[0].direction: must not be zero"},
        {R"({"name": "x", "direction": [0, 0, 1], "degrees": 181})",
         "variables[0].degrees: is 181, but must be between 0 and 180"},
        {R"({"name": "x", "rotation": "all"})", R"(variables[0].rotation: is "all", but must be any)"},
        {R"({"name": "x"})",
         R"(variables[0]: needs exactly one of "uniform", "log_uniform", "integer", "choice", "direction" and "rotation")"},
        {R"({"name": "x", "uniform": [0, 1], "integer": [0, 1]})",
         R"(variables[0]: needs exactly one of "uniform", "log_uniform", "integer", "choice", "direction" and "rotation")"},
        {R"({"name": "x.y", "uniform": [0, 1]})",
         "variables[0].name: must be of letters, digits and underscores"},
        {R"({"uniform": [0, 1]})", "variables[0].name: is missing"},
        {R"({"name": "x", "uniform": [0, 1]}, {"name": "x", "uniform": [0, 1]})",
         R"(variables[1].name: "x" is the name of another variable)"},
        {R"({"name": "x", "uniform": [0, 1], "unit": "m"})", R"(variables[0]: unknown key "unit")"},
        {R"({"name": "x", "uniform": [0, 1]}, {"name": "y", "uniform": [0, 1]})",
         R"(variables[1]: "y" is not used; allowed: {"var": "y"} somewhere in the scene)"},
        {"", "variables: must hold at least one variable"},
    };
    for (const auto& [variables, line] : cases) {
        const std::vector<std::string> problems = problems_of(variables, used);
        ASSERT_FALSE(problems.empty()) << variables;
        EXPECT_EQ(problems.front(), line);
    }
    const std::string size = R"({"name": "size", "uniform": [0, 1]})";
    EXPECT_EQ(problems_of(size, R"("margin": {"var": "sise"}, "transform": {"scale": {"var": "size"}})"),
              (std::vector<std::string>{
                  R"(bodies[0].margin.var: is "sise", which is no variable; the nearest is "size")"}));
    EXPECT_EQ(problems_of(size, R"("velocity": [0, 0, {"var": "size", "time": 2}])"),
              (std::vector<std::string>{
                  R"(bodies[0].velocity[2]: unknown key "time"; the nearest known one is "times")"}));
    EXPECT_EQ(problems_of(R"({"name": "f", "choice": ["a"]})", R"("name": {"var": "f", "times": 2})").front(),
              R"(bodies[0].name: "times" and "plus" are for numbers and vectors of three, but "f" is "a")");
    const SceneTemplate moved =
        made(R"({"name": "x", "uniform": [0, 1]})", R"("margin": {"var": "x", "times": 2})");
    for (const char* value : {"[1]", "[1, 2, 3, 4]", R"([1, "a", 3])", R"({"a": 1})"})
        EXPECT_TRUE(
            test::refusal([&] {
                (void)moved.text_with({{"x", nlohmann::json::parse(value)}});
            }).starts_with("bodies[0].margin: \"times\" and \"plus\" are for numbers and vectors of three"))
            << value;
}

TEST(SceneTemplate, IsNoSceneUntilValuesAreDrawn) {
    const std::string text = text_of(R"({"name": "x", "uniform": [0, 1]})", R"("margin": {"var": "x"})");
    EXPECT_TRUE(is_template(text));
    EXPECT_FALSE(is_template(with("")));
    EXPECT_EQ(test::complaint(text).substr(0, 63),
              "variables: make the scene a template, which has no values yet; ");
    EXPECT_EQ(
        test::complaint(
            made(R"({"name": "x", "uniform": [0, 1]})", R"("margin": {"var": "x"})").text_with({{"x", 0.5}})),
        "");
}

TEST(SceneComments, AreLeftOut) {
    EXPECT_EQ(without_comments("{} // a\n/* b\n */1"), "{}     \n    \n   1");
    EXPECT_EQ(without_comments(R"({"a//b": "/* \" // */"})"), R"({"a//b": "/* \" // */"})");
    const std::string text = "{ // a scene\n \"bodies\": [{\"body\": \"a//b.h5\" /* a file */}]}";
    const SceneSpec spec = parse_scene(text, "");
    EXPECT_EQ(spec.bodies[0].file, "a/b.h5");
    EXPECT_NO_THROW(parse_json(spec.text));
    EXPECT_EQ(test::complaint("{\n /* a\n"),
              "line 2: a comment begins with /* and does not end; allowed: one that ends with */");
    EXPECT_EQ(test::complaint("{ /* a\n b */ \"bodies\" 1}").substr(0, 18), "line 2, column 16:");
}

/// A scene of a body that is there n times, and one that is there once.
std::string counted_scene(const std::string& count, const std::string& variables,
                          const std::string& in_body) {
    return R"({"variables": [)" + variables + R"(], "bodies": [{"body": "one.h5"},
        {"body": "many.h5", "name": "many", "count": )" +
           count + ", " + in_body + "}]}";
}

SceneTemplate counted(const std::string& count, const std::string& variables, const std::string& in_body) {
    std::vector<std::string> problems;
    SceneTemplate result(counted_scene(count, variables, in_body), "", problems);
    EXPECT_EQ(problems, std::vector<std::string>());
    return result;
}

const std::string three_variables =
    R"({"name": "n", "integer": [0, 5]}, {"name": "place", "uniform": [[0, 0, 0], [1, 1, 1]], "copies": 5},
       {"name": "young", "log_uniform": [1e3, 1e6]})";
const std::string varied_body =
    R"("transform": {"translate": {"var": "place", "times": 2}}, "material": {"young": {"var": "young"}},
       "velocity": [0, 0, {"var": "copy", "times": 0.5, "plus": 1}])";

TEST(CountedBodies, AreThereAsOftenAsDrawnWithValuesOfTheirOwn) {
    const SceneTemplate scene = counted(R"({"var": "n"})", three_variables, varied_body);
    EXPECT_TRUE(scene.has_counts());
    std::set<int> counts;
    for (int i = 0; i < 40; ++i) {
        const SceneValues values = scene.draw(3, i);
        const int n = values["n"];
        counts.insert(n);
        const SceneSpec spec = scene.scene_with(values);
        ASSERT_EQ(std::ssize(spec.bodies), 1 + n);
        std::vector<int> entries{0};
        entries.insert(entries.end(), n, 1);
        EXPECT_EQ(scene.entries_of(values), entries);
        ASSERT_EQ(values["place"].size(), 5u) << "whatever n is";
        for (int k = 0; k < n; ++k) {
            const SceneBody& body = spec.bodies[1 + k];
            const auto place = values["place"][std::to_string(k)].get<std::vector<double>>();
            EXPECT_EQ(body.placement.translate, 2 * Eigen::Vector3d(place[0], place[1], place[2]));
            EXPECT_EQ(body.velocity.z(), 1 + 0.5 * k);
            EXPECT_EQ(body.material.young, values["young"].get<double>());
            EXPECT_EQ(body.name, "many");
        }
        EXPECT_NE(values["place"]["0"], values["place"]["1"]);
    }
    EXPECT_EQ(counts, (std::set{0, 1, 2, 3, 4, 5}));
    // The values of a copy do not depend on how many copies there may be.
    const SceneTemplate fewer =
        counted("2", R"({"name": "place", "uniform": [[0, 0, 0], [1, 1, 1]], "copies": 2})",
                R"("velocity": {"var": "place"})");
    EXPECT_EQ(fewer.draw(3, 7)["place"]["1"], scene.draw(3, 7)["place"]["1"]);
    EXPECT_EQ(fewer.scene_with(fewer.draw(3, 7)).bodies.size(), 3u);
    EXPECT_FALSE(made(R"({"name": "x", "uniform": [0, 1]})", R"("margin": {"var": "x"})").has_counts());
}

TEST(CountedBodies, HaveTheEndsOfTheirRangesInAllCopies) {
    const SceneTemplate scene = counted(R"({"var": "n"})", three_variables, varied_body);
    const std::vector<SceneValues> extremes = scene.extremes(1);
    ASSERT_EQ(extremes.size(), 6u);
    EXPECT_EQ(extremes[0]["n"], 0);
    EXPECT_EQ(extremes[1]["n"], 5);
    EXPECT_EQ(extremes[3]["place"]["4"], nlohmann::json({1.0, 1.0, 1.0}));
    EXPECT_EQ(extremes[3]["place"]["0"], extremes[3]["place"]["4"]);
}

TEST(CountedBodies, AreRefusedWhereTheyAreWrong) {
    const auto refusal = [](const std::string& count, const std::string& variables,
                            const std::string& in_body, const SceneValues& values) {
        return test::refusal([&] {
            std::vector<std::string> problems;
            const SceneTemplate result(counted_scene(count, variables, in_body), "", problems);
            result.text_with(values);
        });
    };
    const std::string n = R"({"name": "n", "uniform": [0, 5]})", used = R"("margin": {"var": "n"})";
    EXPECT_EQ(refusal(R"({"var": "n"})", n, used, {{"n", 2.5}}),
              "bodies[1].count: is 2.5, but must be a whole number between 0 and 1000");
    EXPECT_EQ(refusal("1001", n, used, {{"n", 1}}),
              "bodies[1].count: is 1001, but must be a whole number between 0 and 1000");
    EXPECT_EQ(refusal(R"({"var": "n"})",
                      R"({"name": "n", "integer": [1, 3]}, {"name": "v", "uniform": [0, 1], "copies": 2})",
                      R"("margin": {"var": "v"})", {{"n", 3}, {"v", {{"0", 0.1}, {"1", 0.2}}}}),
              "bodies[1].margin.var: \"v\" has 2 copies, but the body has more");
    EXPECT_EQ(refusal("2", R"({"name": "v", "uniform": [0, 1], "copies": 2})", R"("margin": {"var": "v"})",
                      {{"v", {{"0", 0.1}}}}),
              "bodies[1].margin.var: \"v\" has no value for copy 1");
    EXPECT_EQ(
        problems_of(R"({"name": "v", "uniform": [0, 1], "copies": 2})", R"("margin": {"var": "v"})"),
        std::vector<std::string>{
            "bodies[0].margin.var: \"v\" differs from copy to copy; allowed: in a body with \"count\""});
    EXPECT_EQ(
        problems_of(R"({"name": "x", "uniform": [0, 1]})",
                    R"("margin": {"var": "x"}, "velocity": [0, 0, {"var": "copy"}])"),
        std::vector<std::string>{
            "bodies[0].velocity[2].var: \"copy\" differs from copy to copy; allowed: in a body with \"count\""});
    EXPECT_EQ(problems_of(R"({"name": "copy", "uniform": [0, 1]})", R"("margin": {"var": "copy"})").front(),
              "variables[0].name: \"copy\" is the number of a copy of a body");
    EXPECT_EQ(
        problems_of(R"({"name": "x", "uniform": [0, 1], "copies": -1})", R"("margin": {"var": "x"})").front(),
        "variables[0].copies: is -1, but must be between 0 and 1000");
    EXPECT_EQ(test::complaint(with(R"("count": 2)")),
              "bodies[0].count: is for scenes with \"variables\", in whose copies they differ");
}

}  // namespace
}  // namespace nbd
