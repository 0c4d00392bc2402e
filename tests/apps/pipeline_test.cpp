#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "meshing/formats/read_surface.hpp"
#include "tests/apps/small_files.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"

namespace nbd::test {
namespace {

class PipelineTest : public BoxFolder {
 protected:
    /// Output of `collide --pairs`.
    static std::string pairs(const std::string& poses, const std::string& options = "") {
        const nlohmann::json found = result("collide --pairs pairs.csv " + poses + ' ' + options);
        const std::string csv = bytes("pairs.csv");
        EXPECT_EQ(std::ranges::count(csv, '\n'), 1 + found.value("face_pairs", -2)) << poses;
        return csv;
    }
};

TEST_F(PipelineTest, RunsFromASurfaceToASceneWithLearnedBounds) {
    const std::string beam = NBD_ASSETS "/beam.obj";
    const nlohmann::json body = result("mesh " + beam + " -o beam.h5");
    EXPECT_EQ(body["faces"], 1504);
    EXPECT_NEAR(body["volume"].get<double>(), 0.0144, 1e-6);
    const nlohmann::json modes = result("modes beam.h5 -m 16 --csv modes.csv");
    EXPECT_EQ(modes["frequencies_hz"].size(), 16u);

    // The number of threads does not change the files.
    const std::string dataset = "dataset beam.h5 --steps-per-frame 1 ";
    make(dataset + "-o one.h5 --threads 1 --trajectories 3 --frames 3 -q");
    make(dataset + "-o two.h5 --threads 2 --trajectories 3 --frames 3 -q");
    EXPECT_TRUE(bytes("one.shards/000000-000002.h5") == bytes("two.shards/000000-000002.h5"));
    const nlohmann::json data = result(dataset + "-o data.h5 --threads 2 --trajectories 12 --frames 20");
    EXPECT_EQ(data["frames"], 240);
    EXPECT_EQ(data["failed"], 0);
    const std::string train = "train beam.h5 data.h5 --depth 4 -m 16 -k 64 --epochs 30 --held-out 0.1 ";
    EXPECT_EQ(result(train + "-o tree.h5 --threads 2")["nodes"], 31);
    make(train + "-o tree1.h5 --threads 1 -q");
    EXPECT_TRUE(bytes("tree.h5") == bytes("tree1.h5"));
    EXPECT_FALSE(std::filesystem::exists(folder() / "tree.h5.checkpoint"));

    const nlohmann::json table = result("evaluate tree.h5 data.h5 --margins 0,0.1 --csv table.csv");
    ASSERT_EQ(table["rows"].size(), 72u);  // two sets and margins, five depths of three bounds, three levels
    // Networks without training are off by tens of percent; 0.1 covers what these leave out.
    for (const auto& row : table["rows"]) {
        if (row["bound"] == "learned_affine") {
            EXPECT_LT(row["radius_error"], 1) << row;
        } else if (row["margin"] == 0 && row["bound"] == "nbd") {
            EXPECT_LT(row["radius_error"], 0.03) << row;
        } else {
            EXPECT_LE(row["nodes_missing"], row["bound"] == "nbd" ? 0.05 : 0) << row;
        }
    }
    EXPECT_EQ(std::ranges::count(bytes("table.csv"), '\n'), 73);

    write("scene.json", R"({"bodies": [
        {"body": "beam.h5", "tree": "tree.h5", "bounds": "nbd", "margin": 0.1},
        {"body": "beam.h5", "tree": "tree.h5", "bounds": "learned_affine", "margin": 0.1,
         "transform": {"translate": [0.05, 0, 0.15]}, "velocity": [0, 0, -3]}],
        "time": {"dt": 0.005, "frames": 4, "steps_per_frame": 2}})");
    const nlohmann::json scene =
        result("simulate scene.json -o scene.h5 --audit 1 --csv scene.csv --vtu vtu --picture scene.png");
    EXPECT_EQ(scene["audited_frames"], 4);
    EXPECT_GT(scene["near_pairs"], 1000);
    EXPECT_EQ(scene["near_pairs_missed"], 0);
    EXPECT_GT(scene["frames_in_contact"], 0);
    EXPECT_EQ(std::ranges::count(bytes("scene.csv"), '\n'), 9);  // one line per step
    for (const char* part :
         {"update_us", "collision_us", "detect_us", "assemble_us", "solve_us", "rest_us", "output_us"}) {
        EXPECT_GT(scene[part], 0) << part;
        const std::string column = std::string(",") + part + ",";
        EXPECT_EQ(bytes("scene.csv").find(column) == std::string::npos, part == std::string("output_us"))
            << part;
    }
    EXPECT_EQ(bytes("scene.png").substr(1, 3), "PNG");
    EXPECT_EQ(listing(folder() / "vtu").size(), 6u);  // the rest pose, four frames, scene.pvd

    // The three ways to give a pose are equivalent, and conservative bounds do not change the pairs.
    write("moved.obj", obj_file(moved(read_surface(beam), 0.0137, 0.0171, 0.0113)));
    const std::string exact = pairs(beam + " moved.obj");
    EXPECT_GT(std::ranges::count(exact, '\n'), 100);
    EXPECT_EQ(pairs("tree.h5@" + beam + " moved.obj"), exact);
    EXPECT_EQ(pairs("tree.h5@scene.h5:0:0 tree.h5@moved.obj"), exact);
    EXPECT_EQ(pairs("tree.h5@scene.h5:0:0 tree.h5@moved.obj", "--bounds bd"), exact);
    for (const std::string bounds : {"nbd", "learned_affine"}) {  // as calibrated, and grown
        EXPECT_EQ(pairs("tree.h5@scene.h5:0:0 tree.h5@moved.obj", "--bounds " + bounds), exact);
        EXPECT_EQ(pairs("tree.h5@scene.h5:0:0 tree.h5@moved.obj", "--bounds " + bounds + " --margin 0.1"),
                  exact);
    }

    // Affine bounds come with the tree, find the same pairs, and need no tree in a scene.
    EXPECT_EQ(pairs("tree.h5@scene.h5:0:0 tree.h5@scene.h5:1:4", "--bounds affine"),
              pairs("tree.h5@scene.h5:0:0 tree.h5@scene.h5:1:4"));
    const nlohmann::json covered =
        result("coverage tree.h5 data.h5 --contacts 10 --bounds affine,boxes,learned_affine");
    ASSERT_EQ(covered["contact_scenes"].size(), 3u);
    for (const std::size_t row : {0u, 1u}) {
        EXPECT_GT(covered["contact_scenes"][row]["face_pairs"], 0);
        EXPECT_EQ(covered["contact_scenes"][row]["missed"], 0);
    }
    for (const auto& row : covered["coverage"]) EXPECT_EQ(row["bound"], "learned_affine");
    for (const std::string tree : {"", R"("tree": "tree.h5", )"})
        for (const std::string bounds : {"exact", "affine"}) {
            write("hung.json", R"({"bodies": [
                {"body": "beam.h5"}, {"body": "beam.h5", )" +
                                   tree + R"(
                 "transform": {"translate": [0.05, 0, 0.15]}, "velocity": [0, 0, -3]}],
                "time": {"dt": 0.005, "frames": 4, "steps_per_frame": 2}})");
            const nlohmann::json hung =
                result("simulate hung.json -o " + bounds + "_scene.h5 --bounds " + bounds + " --audit 1");
            EXPECT_GT(hung["near_pairs"], 0);
            EXPECT_EQ(hung["near_pairs_missed"], 0);
        }

    const nlohmann::json race = result("race scene.json --csv race.csv")["bounds"];
    const auto row = std::ranges::find(race, "learned_affine", [](const auto& r) { return r["bounds"]; });
    ASSERT_NE(row, race.end());
    EXPECT_GT((*row)["near_pairs"], 0);
    EXPECT_EQ((*row)["audited_frames"], 4);
    for (const nlohmann::json& exact_row : race)
        if (exact_row["bounds"] == "boxes" || exact_row["bounds"] == "affine") {
            EXPECT_EQ(exact_row["farthest"], 0.0);
        }
    EXPECT_EQ(std::ranges::count(bytes("race.csv"), '\n'), static_cast<std::ptrdiff_t>(race.size()) + 1);

    // Every supported instruction set gives the same numbers.
    for (const std::string instructions : {"plain", "avx2", "avx512", "neon"}) {
        const bool known = run("inspect beam.h5 --instructions " + instructions).status == 0;
        EXPECT_TRUE(known || instructions != "plain");
        if (!known) continue;
        result("evaluate tree.h5 data.h5 --margins 0,0.1 --csv again.csv --instructions " + instructions);
        EXPECT_EQ(bytes("again.csv"), bytes("table.csv")) << instructions;
        EXPECT_EQ(pairs(beam + " moved.obj", "--instructions " + instructions), exact) << instructions;
    }

    EXPECT_THAT(bench("peers data.h5 --body beam.h5 tree.h5 --scenes 1 --rounds 1 --contact light --light 4 "
                      "--methods boxes -o peers --instructions plain")
                    .out,
                testing::HasSubstr("plain kernels"));
    std::filesystem::remove_all(folder() / "peers");

    const auto exported = result("export --flat tree.h5 -o tree.nbd");
    EXPECT_EQ(exported["bytes"], bytes("tree.nbd").size());
    for (const std::string file : {"beam.h5", "data.h5", "tree.h5", "tree.nbd", "scene.h5"})
        EXPECT_EQ(result("inspect " + file)["whole"], true) << file;
    EXPECT_EQ(
        listing(folder()),
        (std::set<std::string>{"box.obj",        "box.h5",     "beam.h5",    "modes.csv", "one.h5",
                               "one.shards",     "two.h5",     "two.shards", "data.h5",   "data.shards",
                               "tree.h5",        "tree1.h5",   "tree.nbd",   "table.csv", "race.csv",
                               "again.csv",      "scene.json", "scene.h5",   "scene.csv", "vtu",
                               "scene.png",      "moved.obj",  "pairs.csv",  "hung.json", "exact_scene.h5",
                               "affine_scene.h5"}));
}

}  // namespace
}  // namespace nbd::test
