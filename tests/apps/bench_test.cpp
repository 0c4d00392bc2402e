#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <utility>

#include "tests/apps/small_files.hpp"

namespace nbd {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

class Bench : public test::SmallFiles {
 protected:
    static void SetUpTestSuite() {
        SmallFiles::SetUpTestSuite();
        make("mesh box.obj -o other.h5 --nodes 200 -q");
    }
};

TEST_F(Bench, SimulateShowsThatBothSolversAgree) {
    const json rows = bench_result("simulate box.h5 --steps 4 -o table.csv");
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
    for (const auto& row : bench_result("simulate box.h5 --steps 4 --tolerance 0.1"))
        if (row.at("scene") != "drop") {
            EXPECT_GT(row.at("relative_difference").get<double>(), 1e-6)
                << row;  // solvers that differ are seen
        }
}

TEST_F(Bench, ElementsComparesBodiesAndSurfacesInCages) {
    const json rows =
        bench_result("elements box.h5 box.obj --cage 60 --levels 1 --repeats 1 -o elements.csv");
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

TEST_F(Bench, PeersComparesMethodsOnRecordedPosesWithEqualAnswers) {
    const json rows = bench_result(
        "peers data.h5 --body box.h5 -o peers --scenes 2 --rounds 1 --light 4 --heavy 6 --clusters 32");
    ASSERT_GE(rows.size(), 2 * 4U);  // contacts, methods
    for (const auto& row : rows) {
        EXPECT_EQ(row.at("faces"), 108);
        EXPECT_EQ(row.at("missed"), 0) << row;
        EXPECT_EQ(row.at("invented"), 0) << row;
        EXPECT_GE(row.at("pairs").get<double>(), row.at("contact") == "light" ? 3 : 5) << row;
        EXPECT_GT(row.at("total_us").get<double>(), 0) << row;
    }
    EXPECT_THAT(test::listing(folder() / "peers"), ElementsAre("peers.csv"));
}

TEST_F(Bench, Figure5UsesTheFramesInWhichBodiesTouch) {
    write("scene.json", R"({"bodies": [
        {"body": "box.h5", "velocity": [1, 0, 0]},
        {"body": "box.h5", "transform": {"translate": [0.42, 0.02, 0.01]}, "velocity": [-1, 0, 0]}],
        "gravity": [0, 0, 0], "time": {"dt": 0.005, "frames": 8}})");
    make("simulate scene.json -o scene.h5 -q");
    const json rows = bench_result("fig5 scene.h5 --body box.h5 tree.h5 -o fig5 --distance 0.1 --rounds 1");
    std::set<std::string> methods;
    for (const auto& row : rows) {
        EXPECT_EQ(row.at("contact"), "recorded");
        methods.insert(row.at("method"));
    }
    EXPECT_THAT(methods, ElementsAre("exact", "nbd"));
    EXPECT_THAT(test::listing(folder() / "fig5"), ElementsAre("figure5.csv"));
}

TEST_F(Bench, ExactnessComparesEveryExactBoundInEveryPose) {
    const json found = bench_result("exactness box.h5 other.h5 --scenes 20 -o exactness.csv");
    EXPECT_EQ(found.at("scenes"), 2 * 20);
    EXPECT_EQ(found.at("different"), 0);
    std::set<std::string> poses;
    for (const auto& row : found.at("rows")) {
        poses.insert(row.at("poses"));
        EXPECT_EQ(row.at("scenes"), 4);
        EXPECT_GE(row.at("queries").get<long>(), 6 * 4) << row;
        EXPECT_GT(row.at("touching").get<long>(), 0) << row;
        EXPECT_GT(row.at("pairs").get<long>(), 0) << row;
    }
    EXPECT_THAT(poses, ElementsAre("crushed", "far", "inverted", "scattered", "twisted"));
    const auto table = test::lines(bytes("exactness.csv"));
    ASSERT_EQ(table.size(), 2 + 2 * 5U);
    EXPECT_EQ(table[1], "body,faces,poses,scenes,touching,pairs,queries,different,first_difference");
    EXPECT_THAT(table[2], StartsWith("box,108,twisted,4,"));
}

/// Rows of a query: a vertex that falls from 1 to `end` above a face, and whether it reaches the face.
std::string fall(const std::string& end, const std::string& answer) {
    std::string rows;
    for (const std::string& height : {std::string("1,1,"), end})
        rows += "1,4,1,4," + height + answer + "\n0,1,0,1,0,1," + answer + "\n1,1,0,1,0,1," + answer +
                "\n0,1,1,1,0,1," + answer + "\n";
    return rows;
}

TEST_F(Bench, ImpactsAgreesWithExactAnswersAndSampling) {
    std::filesystem::create_directories(folder() / "queries" / "fall" / "vertex-face");
    write("queries/fall/vertex-face/a.csv", fall("-1,2,", "1") + fall("1,2,", "0"));
    const json found = bench_result("impacts queries --random 2000 -o impacts.csv");
    EXPECT_EQ(found.at("queries"), 2);
    EXPECT_EQ(found.at("missed"), 0);
    EXPECT_EQ(found.at("false_alarms"), 0);
    EXPECT_GT(found.at("random_collisions").get<long>(), 100);
    EXPECT_EQ(found.at("random_missed"), 0);
    EXPECT_EQ(found.at("random_late"), 0);
    const auto table = test::lines(bytes("impacts.csv"));
    ASSERT_EQ(table.size(), 3U);
    EXPECT_EQ(table[1],
              "scene,kind,queries,collisions,missed,false_alarms,exhausted,ns,iterations,most_iterations");
    EXPECT_THAT(table[2], StartsWith("fall,vertex-face,2,1,0,0,0,"));

    std::filesystem::create_directories(folder() / "missed" / "fall" / "vertex-face");
    write("missed/fall/vertex-face/a.csv", fall("1,2,", "1"));  // not true
    const test::Ran missed = bench("impacts missed --random 0");
    EXPECT_EQ(missed.status, 1);
    EXPECT_EQ(missed.err, "nbdtree-bench: error: collisions were missed\n");
}

TEST_F(Bench, ThreadsCountsTheTasksOfStepsAndDatasets) {
    write("falls.json", R"({"bodies": [{"body": "box.h5"}], "time": {"dt": 0.001, "frames": 3}})");
    const json rows =
        bench_result(
            "threads falls.json --steps 2 --dataset box.h5 --trajectories 3 --frames 2 -o threads.csv")
            .at("rows");
    EXPECT_TRUE(test::listing(folder()).contains("threads.csv"));
    std::set<std::string> phases;
    int works = 0;
    for (const json& row : rows) {
        if (row.at("kind") == "phase") phases.insert(row.at("phase").get<std::string>());
        if (row.at("kind") == "counted") {
            ++works;
            EXPECT_GT(row.at("loops").get<double>(), 0);
            EXPECT_GE(row.at("ms_1").get<double>(), row.at("ms_16").get<double>());
        }
        if (row.at("kind") == "loop" &&
            row.at("place").get<std::string>().starts_with("apps/dataset/producer.cpp")) {
            EXPECT_EQ(row.at("tasks"), 3);  // trajectories
        }
    }
    EXPECT_EQ(works, 2);
    for (const char* phase : {"assemble", "solve", "detect", "update", "rest"})
        EXPECT_TRUE(phases.contains(phase)) << phase;
    EXPECT_EQ(std::ranges::count_if(rows,
                                    [](const json& row) {
                                        return row.at("kind") == "loop" &&
                                               row.at("place").get<std::string>().starts_with(
                                                   "apps/dataset/producer.cpp");
                                    }),
              1);
}

TEST_F(Bench, RefusesInvalidInputInOneLine) {
    std::filesystem::create_directories(folder() / "empty");
    for (const auto& [name, row] :
         {std::pair{"words", "a vertex"}, {"zeros", "1,0,1,1,1,1,1"}, {"short", "1,1,1,1,1,1,1"}}) {
        std::filesystem::create_directories(folder() / name / "scene" / "edge-edge");
        write(std::string(name) + "/scene/edge-edge/a.csv", std::string(row) + "\n");
    }
    const struct {
        std::string line;
        int status;
        std::string says;
    } cases[] = {
        {"", 2, ""},
        {"simulate absent.h5", 1, "absent.h5"},
        {"simulate box.h5 --steps 1", 2, "--steps"},
        {"simulate box.h5 -o box.h5", 1, "box.h5"},
        {"elements box.obj --cage 20", 1, "a cage of 20 nodes; allowed: 50"},
        {"elements absent.h5", 1, "absent.h5"},
        {"elements box.h5 box.h5 --levels 1 --repeats 1", 1,
         "two bodies are called box; allowed: different names"},
        {"elements box.h5 --levels 0", 2, "--levels"},
        {"elements box.h5 -o box.h5", 1, "box.h5"},
        {"peers data.h5 --body absent.h5 -o none -q", 1, "absent.h5"},
        {"peers box.h5 --body box.h5 -o none -q", 1, "box.h5"},
        {"peers data.h5 -o none", 2, "--body"},
        {"peers data.h5 --body box.h5 -o none --scenes 0", 2, "--scenes"},
        {"peers data.h5 --body box.h5 -o none --contact soft", 2, "--contact"},
        {"peers data.h5 --body box.h5 -o box.h5 -q", 1, "box.h5"},
        {"peers data.h5 --body box.h5 -o none --light 9999 -q", 1, "intersecting faces"},
        {"peers data.h5 --body box.h5 -o none --methods boxes,fcl", 1, "--methods: fcl is gone; "},
        {"peers data.h5 --body box.h5 --body other.h5 -o none -q", 1, "its tetrahedra are not those of"},
        {"peers data.h5 --body other.h5 tree.h5 -o none -q", 1,
         "tree.h5: this tree belongs to another body than other.h5"},
        {"peers data.h5 --body box.h5 -o none --methods 'cage boxes*'", 1, "--methods: cage boxes is gone; "},
        {"fig5 data.h5 --body box.h5 -o none -q", 1, "two copies of the first body"},
        {"fig5 data.h5 --body box.h5 -o none --bounds best", 2, "--bounds"},
        {"exactness absent.h5", 1, "absent.h5"},
        {"exactness box.h5 --scenes 0", 2, "--scenes"},
        {"exactness box.h5 -o box.h5", 1, "box.h5"},
        {"threads", 2, "name scenes, --dataset or --train"},
        {"threads absent.json", 1, "absent.json"},
        {"threads absent.json --skip 0", 2, "--skip"},
        {"threads --dataset absent.h5", 1, "absent.h5"},
        {"impacts absent", 2, "FOLDER"},
        {"impacts words --random 0 -q", 1, "a.csv, line 1: allowed: seven whole numbers separated by commas"},
        {"impacts zeros --random 0 -q", 1,
         "a.csv, line 1: allowed: denominators other than 0, and an answer of 0 or 1"},
        {"impacts short --random 0 -q", 1, "a.csv: 1 lines; allowed: a multiple of 8"},
        {"impacts empty --random 0 -q", 1,
         "empty: no queries; allowed: a folder with SCENE/edge-edge/*.csv or SCENE/vertex-face/*.csv"},
    };
    for (const auto& [line, status, says] : cases) {
        SCOPED_TRACE("nbdtree-bench " + line);
        const test::Ran ran = bench(line);
        EXPECT_EQ(ran.status, status);
        EXPECT_THAT(ran.err, HasSubstr(says));
        EXPECT_EQ(std::ranges::count(ran.err, '\n'), 1) << ran.err;
    }
    EXPECT_FALSE(std::filesystem::exists(folder() / "none"));
}

TEST_F(Bench, GoneCommandsSayWhatToDoInstead) {
    for (const std::string command : {"kernels", "learned", "local", "scaling", "solvers", "laws", "ring",
                                      "networks", "strengths", "self"}) {
        const test::Ran ran = bench("-q " + command + " box.h5 --steps 2");
        EXPECT_EQ(ran.status, 2) << command;
        const std::string says = "nbdtree-bench: error: `nbdtree-bench " + command + "` is gone";
        EXPECT_TRUE(ran.err.starts_with(says)) << ran.err;
        EXPECT_NE(ran.err.find("`nbdtree", says.size()), std::string::npos) << ran.err;
        EXPECT_EQ(std::ranges::count(ran.err, '\n'), 1) << ran.err;
        EXPECT_EQ(ran.out, "");
    }
}

}  // namespace
}  // namespace nbd
