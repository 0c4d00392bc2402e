#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/apps/small_files.hpp"

namespace nbd {
namespace {

using BenchSimulate = test::BoxFolder;

TEST_F(BenchSimulate, ShowsThatBothSolversAgree) {
    const test::Ran ran =
        test::run_bench(folder(), {"simulate", "box.h5", "--steps", "4", "-o", "table.csv", "--json"});
    ASSERT_EQ(ran.status, 0) << ran.err;
    const auto rows = nlohmann::json::parse(ran.out);
    ASSERT_EQ(rows.size(), 3U);
    for (const auto& row : rows) {
        EXPECT_EQ(row.at("body"), "box");
        EXPECT_GT(row.at("step_ratio").get<double>(), 0);
        // Without contact, the tolerance of the linear solves alone lets solvers differ; which contacts slip
        // is settled by passes that may end elsewhere.
        EXPECT_LT(row.at("relative_difference").get<double>(), row.at("scene") == "drop" ? 1e-3 : 1e-6)
            << row;
    }
    EXPECT_TRUE(test::listing(folder()).contains("table.csv"));

    const test::Ran loose =
        test::run_bench(folder(), {"simulate", "box.h5", "--steps", "4", "--tolerance", "0.1", "--json"});
    ASSERT_EQ(loose.status, 0) << loose.err;
    for (const auto& row : nlohmann::json::parse(loose.out)) {
        if (row.at("scene") == "drop") continue;
        EXPECT_GT(row.at("relative_difference").get<double>(), 1e-6) << row;  // solvers that differ are seen
    }
}

TEST_F(BenchSimulate, RejectsInvalidInput) {
    const test::Ran none = test::run_bench(folder(), {"simulate", "absent.h5"});
    EXPECT_EQ(none.status, 1);
    EXPECT_NE(none.err.find("absent.h5"), std::string::npos) << none.err;
    EXPECT_EQ(test::run_bench(folder(), {"simulate", "box.h5", "--steps", "1"}).status, 2);
    EXPECT_EQ(test::run_bench(folder(), {}).status, 2);
    EXPECT_EQ(test::run_bench(folder(), {"simulate", "box.h5", "-o", "box.h5"}).status, 1);
}

TEST_F(BenchSimulate, ComparesElementsOfBodiesAndOfSurfacesInCages) {
    const test::Ran ran =
        test::run_bench(folder(), {"elements", "box.h5", "box.obj", "--cage", "60", "--levels", "1",
                                   "--repeats", "1", "-o", "elements.csv", "--json"});
    ASSERT_EQ(ran.status, 0) << ran.err;
    const auto rows = nlohmann::json::parse(ran.out);
    ASSERT_EQ(rows.size(), 10U);
    EXPECT_EQ(rows[0].at("body"), "box");
    EXPECT_TRUE(rows[5].at("body").get<std::string>().starts_with("box_")) << rows[5];
    for (const std::size_t body : {0, 5}) {
        EXPECT_EQ(rows[body + 1].at("unknowns"), rows[body + 2].at("unknowns"));
        EXPECT_LT(rows[body + 1].at("displacement_error"), rows[body].at("displacement_error"));
        EXPECT_TRUE(rows[body + 4].at("reference").get<bool>());
        EXPECT_TRUE(rows[body + 4].at("displacement_error").is_null());  // two meshes tell no rate
    }
    EXPECT_TRUE(test::listing(folder()).contains("elements.csv"));
}

TEST_F(BenchSimulate, RefusesBodiesThatElementsCannotCompare) {
    const test::Ran coarse = test::run_bench(folder(), {"elements", "box.obj", "--cage", "20"});
    EXPECT_EQ(coarse.status, 1);
    EXPECT_NE(coarse.err.find("a cage of 20 nodes; allowed: 50"), std::string::npos) << coarse.err;
    EXPECT_EQ(test::run_bench(folder(), {"elements", "absent.h5"}).status, 1);
    const test::Ran twice =
        test::run_bench(folder(), {"elements", "box.h5", "box.h5", "--levels", "1", "--repeats", "1"});
    EXPECT_EQ(twice.status, 1);
    EXPECT_NE(twice.err.find("two bodies are called box; allowed: different names"), std::string::npos)
        << twice.err;
    EXPECT_EQ(test::run_bench(folder(), {"elements", "box.h5", "--levels", "0"}).status, 2);
    EXPECT_EQ(test::run_bench(folder(), {"elements", "box.h5", "-o", "box.h5"}).status, 1);
}

TEST_F(BenchSimulate, GoneCommandsSayWhatToDoInstead) {
    for (const char* command : {"kernels", "learned", "local", "scaling", "solvers", "laws", "ring",
                                "networks", "strengths", "self"}) {
        const test::Ran ran = test::run_bench(folder(), {"-q", command, "box.h5", "--steps", "2"});
        EXPECT_EQ(ran.status, 2) << command;
        const std::string says = std::string("nbdtree-bench: error: `nbdtree-bench ") + command + "` is gone";
        EXPECT_TRUE(ran.err.starts_with(says)) << ran.err;
        EXPECT_NE(ran.err.find("`nbdtree", says.size()), std::string::npos) << ran.err;
        EXPECT_EQ(std::ranges::count(ran.err, '\n'), 1) << ran.err;
        EXPECT_EQ(ran.out, "");
    }
}

using BenchPeers = test::SmallFiles;

TEST_F(BenchPeers, ComparesMethodsOnRecordedPosesWithEqualAnswers) {
    const test::Ran ran = test::run_bench(
        folder(), {"peers", "data.h5", "--body", "box.h5", "-o", "peers", "--scenes", "2", "--rounds", "1",
                   "--light", "4", "--heavy", "6", "--clusters", "32", "--json"});
    ASSERT_EQ(ran.status, 0) << ran.err;
    const auto rows = nlohmann::json::parse(ran.out);
    ASSERT_GE(rows.size(), 4 * 8U);  // contacts, orders, methods
    for (const auto& row : rows) {
        EXPECT_EQ(row.at("faces"), 108);
        EXPECT_EQ(row.at("missed"), 0) << row;
        EXPECT_EQ(row.at("invented"), 0) << row;
        EXPECT_GE(row.at("pairs").get<double>(), row.at("contact") == "light" ? 3 : 5) << row;
        EXPECT_GT(row.at("total_us").get<double>(), 0) << row;
    }
    for (const char* file : {"peers/peers.csv", "peers/peers.png"})
        EXPECT_TRUE(std::filesystem::exists(folder() / file)) << file;
}

TEST_F(BenchPeers, RejectInvalidInput) {
    const auto fails = [](const std::vector<std::string>& arguments, int status, const std::string& says) {
        const test::Ran ran = test::run_bench(folder(), arguments);
        EXPECT_EQ(ran.status, status) << ran.err;
        EXPECT_NE(ran.err.find(says), std::string::npos) << ran.err;
        EXPECT_EQ(std::ranges::count(ran.err, '\n'), 1) << ran.err;
    };
    fails({"peers", "data.h5", "--body", "absent.h5", "-o", "none", "-q"}, 1, "absent.h5");
    fails({"peers", "box.h5", "--body", "box.h5", "-o", "none", "-q"}, 1, "box.h5");
    fails({"peers", "data.h5", "-o", "none"}, 2, "--body");
    fails({"peers", "data.h5", "--body", "box.h5", "-o", "none", "--scenes", "0"}, 2, "--scenes");
    fails({"peers", "data.h5", "--body", "box.h5", "-o", "none", "--contact", "soft"}, 2, "--contact");
    fails({"peers", "data.h5", "--body", "box.h5", "-o", "box.h5", "-q"}, 1, "box.h5");
    fails({"peers", "data.h5", "--body", "box.h5", "-o", "none", "--light", "9999", "-q"}, 1,
          "intersecting faces");
    fails({"fig5", "data.h5", "--body", "box.h5", "-o", "none", "-q"}, 1, "two copies of the first body");
    fails({"fig5", "data.h5", "--body", "box.h5", "-o", "none", "--bounds", "best"}, 2, "--bounds");
    fails({"peers", "data.h5", "--body", "box.h5", "-o", "none", "--methods", "boxes,fcl"}, 1,
          "--methods: fcl is gone; ");
    make({"mesh", "box.obj", "-o", "other.h5", "--nodes", "200", "-q"});
    fails({"peers", "data.h5", "--body", "box.h5", "--body", "other.h5", "-o", "none", "-q"}, 1,
          "its tetrahedra are not those of");
    fails({"peers", "data.h5", "--body", "other.h5", "tree.h5", "-o", "none", "-q"}, 1,
          "tree.h5: this tree belongs to another body than other.h5");
    EXPECT_FALSE(std::filesystem::exists(folder() / "none"));
}

TEST_F(BenchPeers, Figure5UsesTheFramesInWhichBodiesTouch) {
    write("scene.json", R"({"bodies": [
        {"body": "box.h5", "velocity": [1, 0, 0]},
        {"body": "box.h5", "transform": {"translate": [0.42, 0.02, 0.01]}, "velocity": [-1, 0, 0]}],
        "gravity": [0, 0, 0], "time": {"dt": 0.005, "frames": 8}})");
    make({"simulate", "scene.json", "-o", "scene.h5", "-q"});
    const test::Ran ran = test::run_bench(folder(), {"fig5", "scene.h5", "--body", "box.h5", "tree.h5", "-o",
                                                     "fig5", "--distance", "0.1", "--rounds", "1", "--json"});
    ASSERT_EQ(ran.status, 0) << ran.err;
    const auto rows = nlohmann::json::parse(ran.out);
    ASSERT_EQ(rows.size(), 2U);
    EXPECT_EQ(rows[0].at("method"), "exact");
    EXPECT_EQ(rows[1].at("method"), "nbd");
    EXPECT_TRUE(std::filesystem::exists(folder() / "fig5" / "figure5.png"));
}

}  // namespace
}  // namespace nbd
