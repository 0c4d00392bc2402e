#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/apps/small_files.hpp"

namespace nbd::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// What a command says of choices that it cannot honour, and of what it wrote.
class MessagesTest : public SmallFiles {
 protected:
    static Ran train(const std::string& more) {
        const Ran ran = run(
            "train box.h5 data.h5 -o x.h5 --depth 2 -k 16 --epochs 1 --held-out 0 --calibration 0 " + more);
        EXPECT_EQ(ran.status, 0) << ran.err;
        return ran;
    }
};

TEST_F(MessagesTest, TrainSaysThatTheBodyHasFewerModes) {
    const std::string all = "box.h5: has 8 modes, all of which are used; `nbdtree modes box.h5 -m ";
    const Ran asked = train("-m 12 --json");
    EXPECT_THAT(asked.err, HasSubstr("nbdtree: warning: " + all + "12` computes 12\n"));
    EXPECT_EQ(nlohmann::json::parse(asked.out)["modes"], 8);
    const Ran plain = train("");
    EXPECT_THAT(plain.out, HasSubstr(all + "128` computes 128\n"));
    EXPECT_THAT(plain.err, Not(HasSubstr("modes")));
    const Ran fewer = train("-m 4 --json");
    EXPECT_THAT(fewer.err, Not(HasSubstr("modes")));
    EXPECT_EQ(nlohmann::json::parse(fewer.out)["modes"], 4);
}

TEST_F(MessagesTest, SurfaceFilesRefuseBoundsThatNeedATree) {
    const std::string allowed = " bounds; allowed: exact, boxes, auto, or TREE.h5@POSE instead of the file",
                      no_margin =
                          "--margin: boxes of a surface file take none; allowed: with --bounds exact, or "
                          "TREE.h5@POSE instead of the file";
    expect_refused({
        {"collide box.obj box.obj --bounds nbd", 1, "--bounds: a surface file does not have nbd" + allowed},
        {"collide box.obj box.obj --bounds affine", 1,
         "--bounds: a surface file does not have affine" + allowed},
        {"view box.obj -o x.html --bounds bd", 1, "--bounds: a surface file does not have bd" + allowed},
        {"collide box.obj box.obj --margin 0.1", 1, no_margin},
        {"collide box.obj box.obj --margin 0.1 --bounds boxes", 1, no_margin},
    });
    EXPECT_EQ(result("collide box.obj box.obj")["bounds"][0], "boxes");
    EXPECT_EQ(result("collide box.obj box.obj --bounds boxes")["bounds"][0], "boxes");
    EXPECT_EQ(result("collide box.obj box.obj --bounds exact --margin 0.1")["bounds"][0], "exact");
    // Beside spheres a surface has exact ones, so that the tree's bounds are those that are walked.
    EXPECT_EQ(result("collide tree.h5@box.obj box.obj --bounds bd --margin 1")["bounds"],
              nlohmann::json({"bd", "exact"}));
    EXPECT_EQ(result("collide box.obj tree.h5@box.obj --bounds learned_affine --margin 1")["bounds"],
              nlohmann::json({"boxes", "learned_affine"}));
    make("collide tree.h5@box.obj box.obj --bounds auto --margin 1 --view margin.html -q");
    EXPECT_THAT(run("collide --help").out, HasSubstr("a surface file (with boxes as bounds"));
}

TEST_F(MessagesTest, ViewSaysHowABodyOrATreeIsShown) {
    expect_refused({
        {"view box.h5 -o x.html", 1,
         "box.h5: is a body, which has no poses; allowed: RECORDING.h5:trajectory --body box.h5, "
         "TREE.h5@RECORDING.h5:trajectory, or a surface file"},
        {"view tree.h5 -o x.html", 1,
         "tree.h5: is a tree, which has no poses; allowed: tree.h5@RECORDING.h5:trajectory, or "
         "tree.h5@SURFACE"},
    });
}

TEST_F(MessagesTest, OutputsRefuseOtherExtensions) {
    write("falling.json", R"({"bodies": [{"body": "box.h5"}]})");
    write("shown.json", R"({"bodies": [{"body": "box.h5"}], "output": {"picture": "run.jpg"}})");
    const auto ends = [](const std::string& path, const std::string& in, const std::string& allowed) {
        return path + ": cannot be written: its name ends in " + in + "; allowed: " + allowed;
    };
    expect_refused({
        {"mesh box.obj -o body.txt", 1, ends("body.txt", ".txt", ".h5")},
        {"mesh box.obj -o body", 1, "body: cannot be written: its name has no extension; allowed: .h5"},
        {"modes box.h5 --csv modes.txt", 1, ends("modes.txt", ".txt", ".csv")},
        {"dataset box.h5 -o data.hdf5", 1, ends("data.hdf5", ".hdf5", ".h5")},
        {"dataset box.h5 -o x.h5 --csv x.xls", 1, ends("x.xls", ".xls", ".csv")},
        {"remap data.h5 --from box.h5 --to box.h5 -o x.csv", 1, ends("x.csv", ".csv", ".h5")},
        {"train box.h5 data.h5 -o tree.nbd", 1, ends("tree.nbd", ".nbd", ".h5")},
        {"calibrate tree.h5 data.h5 -o x.pt", 1, ends("x.pt", ".pt", ".h5")},
        {"transfer tree.h5 box.h5 -o x.pt", 1, ends("x.pt", ".pt", ".h5")},
        {"evaluate tree.h5 data.h5 --csv x.tsv", 1, ends("x.tsv", ".tsv", ".csv")},
        {"coverage tree.h5 data.h5 --csv x.h5", 1, ends("x.h5", ".h5", ".csv")},
        {"export tree.h5 --flat -o x.h5", 1, ends("x.h5", ".h5", ".nbd")},
        {"export data.h5:0 --body box.h5 --gltf x.gltf", 1, ends("x.gltf", ".gltf", ".glb")},
        {"export data.h5:0 --body box.h5 --mdd x.pc2", 1, ends("x.pc2", ".pc2", ".mdd")},
        {"export data.h5:0 --body box.h5 --pc2 x.mdd", 1, ends("x.mdd", ".mdd", ".pc2")},
        {"view box.obj -o x.png", 1, ends("x.png", ".png", ".html")},
        {"collide box.obj box.obj --pairs x.html", 1, ends("x.html", ".html", ".csv")},
        {"collide box.obj box.obj --view x.csv", 1, ends("x.csv", ".csv", ".html")},
        {"race falling.json --csv x.h5", 1, ends("x.h5", ".h5", ".csv")},
        {"simulate falling.json -o x.png", 1, ends("x.png", ".png", ".h5")},
        {"simulate falling.json -o x.h5 --csv x.txt", 1, ends("x.txt", ".txt", ".csv")},
        {"simulate falling.json -o x.h5 --picture x.jpg", 1, ends("x.jpg", ".jpg", ".png")},
        {"simulate shown.json -o x.h5", 1,
         "shown.json: output.picture: is \"run.jpg\", but must end in .png"},
    });
}

TEST_F(MessagesTest, SimulateNamesAllThatItWrote) {
    write("short.json", R"({"bodies": [{"body": "box.h5"}], "time": {"frames": 2}})");
    const std::string said = text(
        "simulate short.json -o short.h5 --csv short.csv --vtu short_vtu --obj short_obj --picture short.png");
    EXPECT_THAT(said, HasSubstr("short.h5: 2 frames, "));
    EXPECT_THAT(said, HasSubstr("\nshort.csv: table with one line per step\n"
                                "short_vtu: folder of frames, which scene.pvd opens\n"
                                "short_obj: folder of surfaces, one file per frame and body\n"
                                "short.png: picture of up to six frames\n"));
    EXPECT_THAT(text("simulate short.json -o short.h5"), Not(HasSubstr("table")));
}

TEST_F(MessagesTest, TrainRefusesToRunAsSeveralProcesses) {
    const auto as_rank = [](const char* rank) {
        return run("train box.h5 data.h5 -o ranks.h5",
                   {{"OMPI_COMM_WORLD_SIZE", "3"}, {"OMPI_COMM_WORLD_RANK", rank}});
    };
    const Ran first = as_rank("0"), other = as_rank("2");
    EXPECT_EQ(first.status, 1);
    EXPECT_EQ(
        first.err,
        "nbdtree: error: train: was started as 3 processes; allowed: one, without mpirun or srun, which uses "
        "all cores\n");
    EXPECT_EQ(other.status, 0);
    EXPECT_EQ(first.out + other.out + other.err, "");
    EXPECT_FALSE(std::filesystem::exists(folder() / "ranks.h5"));
}

}  // namespace
}  // namespace nbd::test
