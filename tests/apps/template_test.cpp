// Datasets of scenes with variables, as users make them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <csignal>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "meshing/body/body.hpp"
#include "meshing/formats/read_surface.hpp"
#include "tests/apps/small_files.hpp"
#include "tests/support/file_damage.hpp"
#include "training/files/recording.hpp"

namespace nbd::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// A box that flies, turned and directed as drawn, beside another one that spins, of a drawn size.
json flying_scene() {
    return {{"variables",
             {{{"name", "speed"}, {"log_uniform", {0.5, 2}}},
              {{"name", "way"}, {"direction", {0, 0, 1}}, {"degrees", 30}},
              {{"name", "turn"}, {"rotation", "any"}},
              {{"name", "size"}, {"choice", {0.5, 1}}}}},
            {"gravity", {0, 0, 0}},
            {"bodies",
             {{{"body", "box.h5"},
               {"name", "flying"},
               {"material", {{"rayleigh_mass", 0}}},
               {"transform", {{"rotate", {{"var", "turn"}}}, {"translate", {1, 2, {{"var", "size"}}}}}},
               {"velocity", {{"var", "way"}, {"times", 0.5}, {"plus", {0, 0, 1}}}}},
              {{"body", "box.h5"},
               {"name", "other"},
               {"angular_velocity", {0, 0, {{"var", "speed"}}}},
               {"transform", {{"scale", {{"var", "size"}}}, {"translate", {5, 5, 5}}}}}}},
            {"time", {{"dt", 0.004}, {"frames", 5}, {"steps_per_frame", 3}}}};
}

/// A box whose lowest point is at a drawn height above a floor.
json dropped_scene(double low, double high) {
    return {{"variables", {{{"name", "height"}, {"uniform", {low, high}}}}},
            {"bodies", {{{"body", "box.h5"}, {"transform", {{"translate", {0, 0, {{"var", "height"}}}}}}}}},
            {"obstacles", {{{"plane", {{"normal", {0, 0, 1}}}}}}},
            {"time", {{"frames", 2}}}};
}

class TemplateTest : public BoxFolder {
 protected:
    static void SetUpTestSuite() {
        BoxFolder::SetUpTestSuite();
        write("flying.json", flying_scene().dump(2));
        make(command("whole", "--threads 2 --values values.csv"));
    }

    static std::string command(const std::string& name, const std::string& more = "",
                               const std::string& rule = "1..") {
        fs::create_directory(folder() / name);
        return fmt::format(
            "dataset flying.json -o {}/data.h5 --body flying --trajectories 7 --per-shard 3 -q --hold-out "
            "variables.size={} {}",
            name, rule, more);
    }

    static std::map<std::string, std::string> files(const std::string& name) {
        std::map<std::string, std::string> result;
        for (const auto& entry : fs::recursive_directory_iterator(folder() / name))
            if (entry.is_regular_file() && entry.path().filename() != ".claims")
                result[fs::relative(entry.path(), folder() / name)] = read_bytes(entry.path());
        return result;
    }

    static json recipe(const RecordingReader& recording, int trajectory) {
        return json::parse(recording.trajectories()[trajectory].recipe.str());
    }
};

Eigen::Vector3d vector_of(const json& numbers) {
    return {numbers[0].get<double>(), numbers[1].get<double>(), numbers[2].get<double>()};
}

TEST_F(TemplateTest, PosesAreThoseOfTheDrawnValues) {
    const RecordingReader recording(folder() / "whole/data.h5");
    const Body box = load_body(folder() / "box.h5");
    const double dt = 0.004, per_frame = 3;
    ASSERT_EQ(recording.trajectories().size(), 7u);
    std::set<double> speeds;
    for (int i = 0; i < 7; ++i) {
        const json values = recipe(recording, i)["variables"];
        const double size = values["size"];
        speeds.insert(values["speed"].get<double>());
        ASSERT_EQ(recording.trajectories()[i].frames, 5);
        const Eigen::Vector3d velocity = 0.5 * vector_of(values["way"]) + Eigen::Vector3d(0, 0, 1);
        const Eigen::AngleAxisd turn(values["turn"]["degrees"].get<double>() * EIGEN_PI / 180,
                                     vector_of(values["turn"]["axis"]));
        for (int frame = 0; frame < 5; ++frame) {
            Vertices x;
            recording.read(i, frame, 1, x);
            const double time = (frame + 1) * per_frame * dt;
            EXPECT_NEAR(recording.times(i)[frame], time, 1e-12);
            const Eigen::RowVector3d at = Eigen::RowVector3d(1, 2, size) + time * velocity.transpose();
            const Nodes expected = (box.tets.X * turn.toRotationMatrix().transpose()).rowwise() + at;
            EXPECT_LT((x.cast<double>() - expected).cwiseAbs().maxCoeff(), 2e-6) << i << ", frame " << frame;
        }
    }
    EXPECT_EQ(speeds.size(), 7u);
}

TEST_F(TemplateTest, ThreadsShardsAndKillsGiveTheSameFiles) {
    const auto whole = files("whole");
    ASSERT_EQ(whole.size(), 6u);  // view, plan, card, three shards
    for (const std::string shard : {"1/2", "0/2"}) make(command("array", "--threads 1 --shard " + shard));
    make(command("array"));
    EXPECT_TRUE(files("array") == whole);

    for (const char* state : {"frames of trajectories|3", "frames of trajectories|12", "trajectories|2"}) {
        const Ran ran = run(command("killed", "--threads 1"), {{"NBDTREE_AT", std::string(state) + "|kill"}});
        ASSERT_EQ(ran.status, -SIGKILL) << state << ran.err;
    }
    make(command("killed"));
    auto found = files("killed");
    std::erase_if(found, [](const auto& file) { return file.first.ends_with(".tmp"); });
    EXPECT_TRUE(found == whole);
    make("inspect --check whole/data.h5 --body box.h5");
}

TEST_F(TemplateTest, TellsValuesInATable) {
    const RecordingReader recording(folder() / "whole/data.h5");
    const std::vector<std::string> table = lines(bytes("values.csv"));
    ASSERT_EQ(table.size(), 8u);
    EXPECT_EQ(
        table[0],
        "trajectory,drawn_again,size,speed,turn.axis.x,turn.axis.y,turn.axis.z,turn.degrees,way.x,way.y,way.z,"
        "frames,failure");
    for (int i = 0; i < 7; ++i) {
        const std::vector<std::string> row = cells(table[i + 1]);
        const json values = recipe(recording, i)["variables"];
        EXPECT_EQ(row[0], std::to_string(i));
        EXPECT_EQ(std::stod(row[3]), values["speed"].get<double>());
        EXPECT_EQ(std::stod(row[8]), values["way"][0].get<double>());
    }
}

TEST_F(TemplateTest, SplitsByAVariable) {
    const std::string card = bytes("whole/data.shards/README.md");
    EXPECT_NE(card.find("whose `variables.size` is at least 1.0;"), std::string::npos) << card;
    EXPECT_EQ(error(command("none", "", "7..")).substr(0, 70),
              "nbdtree: error: hold-out rule \"variables.size=7..\" holds out 0 of 7 tr");
}

TEST_F(TemplateTest, TrainsATree) {
    make(
        "train box.h5 whole/data.h5 -o tree.h5 --bounds learned_affine --depth 3 --split parameter --calibration 0 -q");
}

TEST_F(TemplateTest, SimulatesATrajectory) {
    const std::string at_random = text("simulate flying.json -o run.h5 --trajectory 3 --frames 1");
    const RecordingReader recording(folder() / "whole/data.h5");
    const json values = recipe(recording, 3)["variables"];
    EXPECT_NE(at_random.find(fmt::format("speed {:.4g}, turn axis [", values["speed"].get<double>())),
              std::string::npos)
        << at_random;
    // The frames of a dataset and of a run are the same bits.
    make("simulate flying.json -o run.h5 --trajectory 3 --seed 1 -q");
    Vertices of_run, of_dataset;
    RecordingReader(folder() / "run.h5").read(0, 5, 1, of_run);
    recording.read(3, 4, 1, of_dataset);
    EXPECT_TRUE(of_run == of_dataset);
    make("simulate flying.json -o run.h5 --trajectory 3 --seed 1 -q --resume");

    make("simulate flying.json -o set.h5 -q --frames 1 --trajectory 0 --set speed=1 --set size=0.5");
    EXPECT_EQ(
        error("simulate flying.json -o no.h5"),
        "nbdtree: error: flying.json: its variables have no values: speed, way, turn, size; allowed: --trajectory "
        "K, which draws them, or --set NAME=VALUE for each\n");
    EXPECT_EQ(
        error("simulate flying.json -o no.h5 --trajectory 0 --set sped=1"),
        "nbdtree: error: flying.json: \"sped\" is no variable of the scene; allowed: speed, way, turn, size\n");
    write("plain.json", R"({"bodies": [{"body": "box.h5"}]})");
    EXPECT_EQ(
        error("simulate plain.json -o no.h5 --trajectory 0"),
        "nbdtree: error: plain.json: has no variables; allowed: --trajectory, --seed, --draw and --set for a scene with "
        "\"variables\"\n");
}

TEST_F(TemplateTest, DrawsAgainWhereTheStartIntersects) {
    write("dropped.json", dropped_scene(-0.05, 0.15).dump());
    const Ran ran = run("dataset dropped.json -o dropped.h5 --trajectories 24 -q --held-out 0");
    ASSERT_EQ(ran.status, 0) << ran.err;
    EXPECT_NE(ran.err.find(" of the trajectories were drawn again, as their starts intersect, the first is"),
              std::string::npos)
        << ran.err;
    const RecordingReader recording(folder() / "dropped.h5");
    int again = 0;
    for (int i = 0; i < 24; ++i) {
        const json drawn = recipe(recording, i);
        // What is less deep only touches, and is moved.
        EXPECT_GT(drawn["variables"]["height"].get<double>(), drawn.contains("moved_at_start") ? -0.005 : 0);
        EXPECT_EQ(drawn["draw"].get<std::size_t>(), drawn.value("refused_draws", json::array()).size());
        if (drawn["draw"] > 0 && again++ == 0) {
            make(fmt::format("simulate dropped.json -o one.h5 --trajectory {} --draw {} -q", i,
                             drawn["draw"].get<int>()));
            Vertices of_run, of_dataset;
            RecordingReader(folder() / "one.h5").read(0, 2, 1, of_run);
            recording.read(i, 1, 1, of_dataset);
            EXPECT_TRUE(of_run == of_dataset);
        }
        EXPECT_EQ(recording.trajectories()[i].frames, 2);
    }
    EXPECT_GT(again, 1);
    EXPECT_LT(again, 15);
}

TEST_F(TemplateTest, ListsTrajectoriesWithoutAStart) {
    write("under.json", dropped_scene(-0.15, -0.03).dump());
    const Ran ran = run("dataset under.json -o under.h5 --trajectories 2 -q");
    EXPECT_EQ(ran.status, 1);
    EXPECT_NE(ran.err.find("trajectory 1 failed and is left out: the start intersects with all of 9 draws: "
                           "bodies[0] (box): "),
              std::string::npos)
        << ran.err;
    EXPECT_NE(ran.err.find("every trajectory failed"), std::string::npos) << ran.err;
    EXPECT_EQ(lines(text("inspect under.h5")).empty(), false);
}

TEST_F(TemplateTest, RecordsBodiesOfANameInTurn) {
    json scene = flying_scene();
    scene["bodies"][1]["name"] = "flying";
    scene["bodies"][1]["transform"].erase("scale");
    write("two.json", scene.dump());
    make("dataset two.json -o two.h5 --body flying --trajectories 4 -q");
    const RecordingReader recording(folder() / "two.h5");
    for (int i = 0; i < 4; ++i) {
        EXPECT_EQ(recipe(recording, i)["body"], i % 2);
        Vertices x;
        recording.read(i, 0, 1, x);
        EXPECT_EQ(x.col(0).mean() > 4, i % 2 == 1) << i;
    }
}

TEST_F(TemplateTest, TellsOnceWhatHoldsForAllTrajectories) {
    json scene = dropped_scene(0.5, 0.6);
    write("sheet.obj", "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n");
    scene["obstacles"][0] = {{"mesh", {{"file", "sheet.obj"}}}};
    write("sheet.json", scene.dump());
    const Ran ran = run("dataset sheet.json -o sheet.h5 --trajectories 3 -q");
    EXPECT_EQ(ran.status, 0) << ran.err;
    const std::vector<std::string> told = lines(ran.err);
    EXPECT_EQ(std::ranges::count_if(told, [](const auto& line) { return line.find("is open") != line.npos; }),
              1)
        << ran.err;
}

TEST_F(TemplateTest, MakesAFileOfABodyThatHasNone) {
    json scene = dropped_scene(0.01, 0.15);
    scene["bodies"][0].erase("body");
    scene["bodies"][0]["surface"] = "box.obj";
    write("surface.json", scene.dump());
    make("dataset surface.json -o surface.h5 --trajectories 2 -q");
    make("inspect --check surface.h5 --body surface.shards/body.h5");
}

TEST_F(TemplateTest, RefusesWhatIsWrongInOneLine) {
    const auto refused = [](const std::string& name, const json& scene, const std::string& options) {
        write(name, scene.dump());
        return error("dataset " + name + " -o no.h5 " + options, 1)
            .substr(std::string("nbdtree: error: ").size());
    };
    EXPECT_EQ(refused("a.json", flying_scene(), "--body no"),
              "a.json: has no body \"no\" whose poses could be recorded; allowed: flying, other\n");
    json scene = flying_scene();
    EXPECT_EQ(
        refused("a.json", scene, "--body other"),
        "a.json: bodies[1].transform.scale: has a variable, but the poses of this body are recorded, which must "
        "be the same body in all trajectories; allowed: none here, or to record another body\n");
    scene["bodies"][1]["transform"]["scale"] = 2;
    EXPECT_EQ(
        refused("a.json", scene, "--body other"),
        "a.json: bodies[1].transform.scale: is 2, but the poses of this body are recorded; allowed: 1, and "
        "meshing.scale for another size\n");
    scene["bodies"][1].erase("body");
    scene["bodies"][1].erase("transform");
    scene["bodies"][1]["tets"] = "box.h5";
    scene["bodies"][1]["name"] = "flying";
    EXPECT_EQ(refused("a.json", scene, "").substr(0, 70),
              "a.json: bodies[1]: is made otherwise than bodies[0], so their poses ar");
    scene = flying_scene();
    scene["variables"][0]["log_uniform"] = {2, 1};
    EXPECT_EQ(refused("a.json", scene, ""),
              "a.json: variables[0].log_uniform: is [2,1]; the first must not be above the second\n");
    scene = flying_scene();
    scene["bodies"][0]["margin"] = {{"var", "speed"}, {"times", 10}};
    EXPECT_EQ(refused("a.json", scene, "--body flying").substr(0, 66),
              "a.json: bodies[0].margin: is 20, but must be between 0 and 10 (wit");
    EXPECT_EQ(refused("plain.json", json{{"bodies", {{{"body", "box.h5"}}}}}, ""),
              "plain.json: variables: is missing\n");
    EXPECT_EQ(
        error("dataset flying.json -o no.h5 --strength 2", 2),
        "nbdtree: error: --strength: is for the recipes of a body, but this dataset is drawn from a scene\n");
    EXPECT_EQ(error("dataset box.h5 -o no.h5 --body x", 2),
              "nbdtree: error: --body: is for scenes (.json), but this dataset is of a body\n");
    EXPECT_FALSE(fs::exists(folder() / "no.shards"));
}

TEST_F(TemplateTest, ValidateChecksRangesAndDraws) {
    EXPECT_EQ(text("validate flying.json"), "flying.json: valid\n");
    json scene = flying_scene();
    scene["bodies"][0]["material"]["poisson"] = {{"var", "speed"}, {"times", 0.25}};
    write("b.json", scene.dump());
    const Ran ran = run("validate b.json");
    EXPECT_EQ(ran.status, 1);
    EXPECT_EQ(lines(ran.out).size(), 1u) << ran.out;  // only the end of the range is wrong
    EXPECT_EQ(
        ran.out.substr(0, ran.out.find(", turn")),
        "b.json: bodies[0].material.poisson: is 0.5, but must be between -0.999 and 0.4999 (with size 0.5, speed 2");

    write("dropped.json", dropped_scene(-0.05, 0.15).dump());
    write("under.json", dropped_scene(-0.15, -0.03).dump());
    const Ran drops = run("validate dropped.json");
    EXPECT_EQ(drops.status, 0) << drops.out;
    const Ran under = run("validate under.json");
    EXPECT_EQ(under.out.substr(0, 69),
              "under.json: the start intersects in all of 4 trajectories, the first ");
}

TEST_F(TemplateTest, MeshesFilesInUnitsAndStretched) {
    make("mesh box.obj -o sized.h5 -q --units cm --scale 2 --stretch 1 2 0.5");
    const Body plain = load_body(folder() / "box.h5"), sized = load_body(folder() / "sized.h5");
    const auto extent = [](const Body& body) -> Eigen::RowVector3d {
        return body.tets.X.colwise().maxCoeff() - body.tets.X.colwise().minCoeff();
    };
    EXPECT_TRUE(
        extent(sized).isApprox(extent(plain).cwiseProduct(Eigen::RowVector3d(0.02, 0.04, 0.01)), 1e-6));
    make("mesh box.h5 -o again.h5 -q --units mm --stretch 3 1 1");
    EXPECT_TRUE(load_body(folder() / "again.h5")
                    .tets.X.isApprox(plain.tets.X * Eigen::Vector3d(3e-3, 1e-3, 1e-3).asDiagonal(), 1e-14));
}

TEST(PileTemplate, GivesPosesOfAllItsBlocks) {
    const TemporaryFolder folder;
    const Ran ran =
        run(folder / "", "dataset " NBD_ASSETS
                         "/scenes/templates/pile.json -o pile.h5 --trajectories 4 --frames 12 --json");
    ASSERT_EQ(ran.status, 0) << ran.err;
    const json said = json::parse(ran.out);
    EXPECT_EQ(said["failed"], 0);
    EXPECT_EQ(said["frames"], 48);
    EXPECT_GT(said["variety"]["frames_in_contact"], 12);
    const RecordingReader recording(folder / "pile.h5");
    for (int i = 0; i < 4; ++i) {
        Vertices first, last;
        recording.read(i, 0, 1, first);
        recording.read(i, 11, 1, last);
        EXPECT_GT(last.col(2).minCoeff(), -1e-4) << i;
        EXPECT_LT(last.col(2).mean(), first.col(2).mean()) << i;
        EXPECT_EQ(json::parse(recording.trajectories()[i].recipe.str())["body"], i % 3);
    }
}

TEST(GraspTemplate, LiftsEggsOfAllSizes) {
    const TemporaryFolder folder;
    for (const char* more : {"--trajectory 0", "--trajectory 1 --set size=0.064 --set young=1e5",
                             "--trajectory 2 --set size=0.08 --set young=1e6"}) {
        const Ran ran = run(folder / "", "simulate " NBD_ASSETS
                                         "/scenes/templates/grasp.json -o run.h5 --obj frames --quiet " +
                                             std::string(more));
        ASSERT_EQ(ran.status, 0) << ran.err;
        const auto lowest = [&](int frame) {
            return read_surface(folder / fmt::format("frames/0_egg_{:06d}.obj", frame)).X.col(2).minCoeff();
        };
        EXPECT_LT(lowest(5), 0.01) << more;
        EXPECT_GT(lowest(20), 0.05) << more;
    }
}

/// A bar that sags by its weight: frames are the increments of the load, in proportion to which it sags where
/// it is stiff, and as `simulate` finds them.
TEST_F(TemplateTest, RecordsTheIncrementsOfStaticScenes) {
    write("sag.json", json{{"variables", {{{"name", "young"}, {"log_uniform", {1e6, 1e7}}}}},
                           {"bodies",
                            {{{"body", "box.h5"},
                              {"material", {{"young", {{"var", "young"}}}}},
                              {"pins", {{{"box", {{"min", {-1, -1, -1}}, {"max", {0.01, 1, 1}}}}}}}}}},
                           {"time", {{"static", {{"increments", 4}}}}}}
                          .dump());
    for (const int frames : {4, 2}) {
        make(fmt::format("dataset sag.json -o sag{0}.h5 --trajectories 3 -q{1}", frames,
                         frames == 4 ? "" : " --frames 2"));
        const RecordingReader recording(folder() / fmt::format("sag{}.h5", frames));
        ASSERT_EQ(recording.trajectories().size(), 3u);
        const Nodes rest = load_body(folder() / "box.h5").tets.X;
        std::vector<double> stiffness_times_sag;
        for (int i = 0; i < 3; ++i) {
            ASSERT_EQ(recording.trajectories()[i].frames, frames);
            const auto sag = [&](int frame) {
                Vertices x;
                recording.read(i, frame, 1, x);
                return (rest - x.cast<double>()).col(2).maxCoeff();
            };
            const double most = sag(frames - 1);
            stiffness_times_sag.push_back(most * recipe(recording, i)["variables"]["young"].get<double>());
            for (int frame = 0; frame < frames; ++frame) {
                EXPECT_NEAR(recording.times(i)[frame], (frame + 1.0) / frames, 1e-12);
                EXPECT_NEAR(sag(frame), most * (frame + 1) / frames, 0.02 * most);
            }
        }
        for (const double one : stiffness_times_sag)
            EXPECT_NEAR(one, stiffness_times_sag[0], 0.03 * stiffness_times_sag[0]);
    }
    make("simulate sag.json -o sag_run.h5 --trajectory 1 --seed 1 -q");
    Vertices of_run, of_dataset;
    RecordingReader(folder() / "sag_run.h5").read(0, 4, 1, of_run);
    RecordingReader(folder() / "sag4.h5").read(1, 3, 1, of_dataset);
    EXPECT_TRUE(of_run == of_dataset);
}

}  // namespace
}  // namespace nbd::test
