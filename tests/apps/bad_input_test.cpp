#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/apps/small_files.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd::test {
namespace {

class BadInputTest : public SmallFiles {
 protected:
    static void SetUpTestSuite() {
        SmallFiles::SetUpTestSuite();
        write("text.h5", "hello\n");
        write("text.obj", "hello\n");
        write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        write("empty.ply", "");
        write("two.mesh",
              "MeshVersionFormatted 2\nDimension 3\nVertices 5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 1 0\n"
              "Tetrahedra 2\n1 2 3 4 1\n2 5 3 4 2\nEnd\n");
        write(
            "nan.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            "element face 1\nproperty list int int vertex_indices\nend_header\n0 0 0\nnan 0 0\n0 1 0\n"
            "3 0 1 2\n");
        write("far_apart.obj",
              obj_file(joined(box(0.1, 0.1, 0.1, 1), moved(box(0.1, 0.1, 0.1, 1), 90, 0, 0))));
        std::filesystem::create_directory(folder() / "dir");
        for (const std::string name : {"box", "data", "tree"}) {
            const std::string whole = bytes(name + ".h5");
            write("half_" + name + ".h5", std::string_view(whole).substr(0, whole.size() / 2));
        }
        write("other.obj", obj_file(box(0.3, 0.1, 0.1, 3)));
        make("mesh other.obj -o other.h5 -q");
        make("mesh box.obj -o still.h5 -q");  // without modes
    }

    static std::string here(const std::string& name) { return (folder() / name).string(); }
};

const std::string ours = "allowed: a file written by nbdtree";
const std::string foo_bounds = "--bounds: foo not in {exact,boxes,bd,nbd,learned_affine,affine,auto}";

TEST_F(BadInputTest, SaysWhatToWriteInsteadOfBoundsThatAreGone) {
    expect_refused({
        {"collide box.obj box.obj --bounds certified", 2, "--bounds: 'certified' is gone; write affine"},
        {"coverage tree.h5 data.h5 --bounds nbd,certified", 2, "--bounds: 'certified' is gone; ..."},
        {"evaluate tree.h5 data.h5 --bounds learned_boxes", 2,
         "--bounds: 'learned_boxes' is gone; write learned_affine"},
        {"evaluate a.h5 b.h5 --bounds modal", 2, "--bounds: 'modal' is gone; write nbd"},
    });
}

TEST_F(BadInputTest, SaysWhatToDoInsteadOfCommandsAndOptionsThatAreGone) {
    expect_refused({
        {"trust --help", 2, "`nbdtree trust` is gone: use `nbdtree coverage`"},
        {"-q carry a.h5", 2, "`nbdtree carry` is gone: use `nbdtree remap`"},
        {"bench peers", 2, "`nbdtree bench` is gone: run the program `nbdtree-bench`"},
        {"train a.h5 --local-samples=16", 2,
         "`nbdtree train --local-samples` is gone: leave it out; learned_affine bounds have no samples"},
        {"train a.h5 b.h5 -o c.h5 --radius-network 16", 2,
         "`nbdtree train --radius-network` is gone: leave it out; learned_affine bounds have no network"},
        {"dataset a.h5 -o b.h5 --solver direct", 2,
         "`nbdtree dataset --solver` is gone: leave it out; steps are always solved by iteration"},
        {"simulate a.json -o b.h5 --compare-contacts", 2,
         "`nbdtree simulate --compare-contacts` is gone: leave it out; all contacts count"},
        {"simulate a.json -o b.h5 --contacts 0", 2,
         "`nbdtree simulate --contacts` is gone: leave it out; all contacts count"},
        {"dataset a.h5 -o b.h5 --intersection-free", 2,
         "`nbdtree dataset --intersection-free` is gone: leave it out; no pose intersects"},
        {"export tree.h5 --torch a.h5", 2,
         "`nbdtree export --torch` is gone: tree files hold the networks as plain arrays, in nbd/ "
         "(apps/docs/formats.md)"},
        {"inspect trust", 1,
         "trust: no such file"},  // gone names may be values of options and names of files
    });
    const std::string help = text("--help");
    EXPECT_NE(help.find("coverage"), std::string::npos);
    for (const char* old : {"trust", "carry", "bench"}) EXPECT_EQ(help.find(old), std::string::npos) << old;
}

TEST_F(BadInputTest, RejectsWhatAPageCannotShow) {
    expect_refused({
        {"view box.obj", 2, "--output is required"},
        {"view box.obj -o x.html --frames 0", 2,
         "--frames: is '0'; allowed: a whole number from 1 to 100000"},
        {"view box.obj -o x.html --frames 010", 2,
         "--frames: '010' has a leading zero; allowed: a decimal number"},
        {"inspect data.h5 --threads 010", 2, "--threads: '010' has a leading zero; ..."},
        {"view none.h5 -o x.html", 1, "none.h5: no such file"},
        {"view no\n\033ne.h5 -o x.html", 1, "no  ne.h5: no such file"},
        {"view text.h5 -o x.html", 1, "text.h5: ..."},
        {"view half_data.h5 -o x.html", 1, "half_data.h5: ..."},
        {"view data.h5 -o x.html", 1,
         "data.h5: is not the recording of a scene; allowed: data.h5:0 with --body, or TREE.h5@data.h5:0"},
        {"view data.h5:0 -o x.html", 1,
         "data.h5:0: a trajectory alone does not have a surface; allowed: with --body, or TREE.h5@data.h5:0"},
        {"view data.h5:9 --body box.h5 -o x.html", 1, "data.h5: no trajectory 9, it has 3"},
        {"view data.h5:0:99 --body box.h5 -o x.html", 1, "data.h5: no frame 99 in trajectory 0..."},
        {"view data.h5:0 --body other.h5 -o x.html", 1,
         "data.h5: trajectory 0 was recorded from another body than other.h5"},
        {"view box.obj --body box.h5 -o x.html", 1,
         "--body: is for RECORDING.h5:trajectory, but box.obj names none"},
        {"view box.obj -o box.obj", 1, "box.obj: cannot be written: the command also reads this file"},
        {"view box.obj -o none/x.html", 1, "none/x.html: cannot be written: there is no folder..."},
        {"collide box.obj box.obj --view x --pairs x", 1,
         "x: cannot be written: pairs and view are the same file"},
    });
}

TEST_F(BadInputTest, RejectsInvalidCommandLines) {
    const std::string known =
        "; known commands: mesh, modes, dataset, remap, train, calibrate, evaluate, transfer, "
        "export, coverage, simulate, race, validate, collide, inspect, view";
    expect_refused({
        {"--quiet", 2, "no command" + known},
        {"simulat", 2, "unknown command or option 'simulat'; the nearest command is 'simulate'" + known},
        {"--frob", 2, "unknown command or option '--frob'; known commands: ..."},
        {"mesh box.obj -o x.h5 --nods 5", 2,
         "mesh: unknown option '--nods'; the nearest known one is '--nodes'; see nbdtree mesh --help"},
        {"mesh box.obj -o x.h5 --thread=5", 2,
         "mesh: unknown option '--thread'; the nearest known one is '--threads'; see nbdtree mesh --help"},
        {"mesh box.obj ball.obj -o x.h5", 2,
         "mesh: too many arguments, the first that was not expected is 'ball.obj'; see nbdtree mesh --help"},
        {"mesh", 2, "SURFACE is required"},
        {"mesh box.obj", 2, "--output is required"},
        {"collide box.obj", 2, "B is required"},
        {"inspect", 2, "FILE is required"},
        {"inspect box.h5 --threads -1", 2, "--threads: is '-1'; allowed: a whole number from 0 to 1024"},
        {"inspect box.h5 --instructions sse9", 2,
         "--instructions: 'sse9'; allowed: plain, avx2, avx512 and neon"},
        {"inspect ''", 2, "FILE: must not be empty"},
        {"mesh box.obj -o x.h5 --cage 500 --nodes 500", 2, "--nodes excludes --cage"},
        {"mesh box.obj -o x.h5 --cage 500 --subdivide 1", 2, "--subdivide excludes --cage"},
        {"mesh box.obj -o x.h5 --cage 500 --inside box.h5", 2, "--cage excludes --inside"},
        {"mesh box.obj -o x.h5 --inside box.h5 --young 1e5", 2, "--young excludes --inside"},
        {"mesh box.h5 -o x.h5 --young 1e5", 2, "--young: the body file box.h5 has a material of its own"},
        {"mesh box.h5 -o x.h5 --nodes 500", 2, "--nodes: is for surfaces, but box.h5 holds tetrahedra"},
        {"mesh box.msh -o x.h5 --inside box.h5", 2,
         "--inside: takes a surface, but box.msh holds tetrahedra"},
        {"mesh box.msh -o x.h5 --cage 500", 2, "--cage: goes around a surface, but box.msh holds tetrahedra"},
        {"mesh box.obj -o x.h5 --region core:young=1e6", 2,
         "--region: is for groups of tetrahedra, but box.obj is a surface"},
        {"mesh box.h5 -o x.h5 --region core:young=1e6", 2,
         "--region: the body file box.h5 has a material of its own"},
        {"mesh two.mesh -o x.h5 --region 'group 1'", 2,
         "--region: \"group 1\": expected NAME:key=value, such as core:young=2e6"},
        {"mesh two.mesh -o x.h5 --region 'group 1:young=+5'", 2,
         "--region: \"group 1:young=+5\": \"+5\" is not a number"},
        {"mesh two.mesh -o x.h5 --region 'group 1:young'", 2,
         "--region: \"group 1:young\": expected key=value, found \"young\""},
        {"mesh two.mesh -o x.h5 --region 'group 1:young=soft'", 2,
         "--region: \"group 1:young=soft\": \"soft\" is not a number"},
        {"mesh two.mesh -o x.h5 --region 'group 1:young=1,young=2'", 2,
         "--region: \"group 1:young=1,young=2\": key \"young\" occurs twice"},
        {"mesh --region 'group 1:yung=1' two.mesh -o x.h5", 2,
         "--region: \"group 1:yung=1\": key \"yung\" is not known; allowed: young, poisson, density, law; "
         "the nearest is young"},
        {"mesh two.mesh -o x.h5 --region 'group 1:law=jelly'", 2,
         "--region: \"group 1:law=jelly\": law \"jelly\" is not known; allowed: corotated, "
         "stable_neo_hookean, st_venant_kirchhoff"},
        {"mesh box.obj -o x.h5 --law neo_hookean", 2,
         "--law: neo_hookean not in {corotated,stable_neo_hookean,st_venant_kirchhoff}; the nearest is "
         "stable_neo_hookean"},
        {"mesh two.mesh -o x.h5 --region 'group 1:young=1' --region 'group 1:young=2'", 2,
         "--region: names \"group 1\" twice"},
        {"mesh two.mesh -q -o x.h5 --region core:young=1e6", 1,
         "two.mesh: it has no group \"core\" of tetrahedra; allowed: group 1, group 2"},
        {"mesh two.mesh -q -o x.h5 --region 'group 1:poisson=0.7'", 1,
         "two.mesh: region \"group 1\": Poisson's ratio is 0.7; allowed: between -0.999 and 0.4999"},
        {"modes box.h5 --csv ''", 2, "--csv: must not be empty"},
    });
}

TEST_F(BadInputTest, RejectsNumbersOutOfRange) {
    const std::string mesh = "mesh box.obj -q -o x.h5 ", dataset = "dataset box.h5 -o x.h5 ",
                      train = "train box.h5 data.h5 -o x.h5 ";
    expect_refused({
        {mesh + "--nodes -3", 2, "--nodes: is '-3'; allowed: a whole number from 0 to 100000000"},
        {mesh + "--nodes 3", 1,
         "box.obj: 3 nodes are not possible; allowed for a surface of 56 vertices: about ..."},
        {mesh + "--nodes 2.5", 2, "--nodes: is '2.5'; allowed: a whole number from 0 to 100000000"},
        {mesh + "--subdivide 9", 2, "--subdivide: is '9'; allowed: a whole number from 0 to 4"},
        {mesh + "--subdivision butterfly", 2, "--subdivision: butterfly not in {midpoint,loop}"},
        {mesh + "--cage many", 2, "--cage: is 'many'; allowed: a whole number from 50 to 200000"},
        {mesh + "--grading -1", 2, "--grading: is '-1'; allowed: a number >= 0 and <= 2"},
        {mesh + "--young -1", 2, "--young: is '-1'; allowed: a number >= 1e-30 and <= 1e+30"},
        {mesh + "--young 1e300", 2, "--young: is '1e300'; allowed: a number >= 1e-30 and <= 1e+30"},
        {mesh + "--density 1e300", 2, "--density: is '1e300'; allowed: a number >= 1e-30 and <= 1e+30"},
        {mesh + "--scale 1e308", 2, "--scale: is '1e308'; allowed: a number >= 1e-30 and <= 1e+30"},
        {mesh + "--rayleigh-stiffness 1e300", 2,
         "--rayleigh-stiffness: is '1e300'; allowed: a number >= 0 and <= 1e+30"},
        {mesh + "--poisson 0.7", 2, "--poisson: is '0.7'; allowed: a number >= -0.999 and <= 0.4999"},
        {mesh + "--density nan", 2, "--density: is 'nan'; allowed: a number >= 1e-30 and <= 1e+30"},
        {"modes box.h5 -m 100000", 2, "--modes: is '100000'; allowed: a whole number from 1 to 2048"},
        {"modes box.h5 -m 2000", 1, "box.h5: modes: count is 2000, allowed: 1 to ..."},
        {dataset + "--trajectories 0", 2,
         "--trajectories: is '0'; allowed: a whole number from 1 to 1000000"},
        {dataset + "--frames many", 2, "--frames: is 'many'; allowed: a whole number from 1 to 1000000"},
        {dataset + "--shard 3/2", 2, "--shard: '3/2' is not i/N with 0 <= i < N"},
        {dataset + "--shard 50/60", 1, "shard 50/60 of 40 trajectories is empty"},
        {dataset + "--frame-interval 1e6", 1, "excitation: 50 frames of 1e+06 s after a warm-up of ..."},
        {dataset + "--strength 0", 2, "--strength: is '0'; allowed: a number > 0 and at most 1000"},
        {dataset + "--seed -1", 2, "--seed: is '-1'; allowed: a whole number from 0 to 2^64 - 1"},
        {train + "--depth 17", 2, "--depth: is '17'; allowed: a whole number from 0 to 16"},
        {train + "--clusters 3", 2, "--clusters: is '3'; allowed: a whole number from 4 to 100000"},
        {train + "--held-out 1", 2, "--held-out: is '1'; allowed: a number >= 0 and < 1"},
        {train + "--held-out 0.9", 1,
         "data.h5: has 3 complete trajectories, and holding out 3 of them leaves none to train on"},
        {"evaluate tree.h5 data.h5 --bounds foo", 2, foo_bounds},
        {"evaluate tree.h5 data.h5 --bounds exact,affine", 1,
         "tree.h5: affine bounds are not those of the tree's nodes, which are evaluated; `nbdtree coverage` "
         "measures them"},
        {"coverage tree.h5 data.h5 --bounds affine --contacts 0", 1,
         "affine bounds never miss, so they have no coverage to measure"},
        {train + "--bounds bd", 2, "--bounds: bd not in {nbd,learned_affine}; the nearest is nbd"},
        {"transfer tree.h5 box.h5", 2, "--output is required"},
        {"evaluate tree.h5 data.h5 --margins 0,-1", 2,
         "--margins: is '-1'; allowed: a number >= 0 and <= 10"},
        {"evaluate tree.h5 data.h5 --max-frames -1", 2,
         "--max-frames: is '-1'; allowed: a whole number >= 0"},
        {"collide box.obj box.obj --margin -1", 2, "--margin: is '-1'; allowed: a number >= 0 and <= 10"},
        {"collide box.obj box.obj --within nan", 2, "--within: is 'nan'; allowed: a number >= 0"},
        {"collide box.obj box.obj --bounds foo", 2, foo_bounds},
    });
}

TEST_F(BadInputTest, RejectsMissingDamagedAndForeignFiles) {
    const std::string cut = ": is truncated or damaged: ...";
    const auto kind = [](const std::string& path, const std::string& is, const std::string& allowed) {
        return path + ": is a file of format 'nbdtree " + is + "'; allowed: 'nbdtree " + allowed + "'";
    };
    expect_refused({
        {"mesh none.obj -o x.h5", 1, "none.obj: no such file"},
        {"mesh dir -o x.h5", 1, "dir: is a directory, not a surface file"},
        {"mesh text.obj -o x.h5", 1, "text.obj: ..."},
        {"mesh sheet.obj -o x.h5", 1, "sheet.obj: ..."},
        {"mesh none.obj -o x.h5 --cage 500", 1, "none.obj: no such file"},
        {"mesh box.obj -o x.h5 --inside none.h5", 1, "none.h5: ..."},
        {"mesh empty.ply -o x.h5 --cage 500", 1, "empty.ply: the file is empty"},
        {"mesh nan.ply -o x.h5 --cage 500", 1, "nan.ply: vertex 1 is not finite: (nan, 0, 0)"},
        {"mesh far_apart.obj -o x.h5 --cage 50", 1,
         "far_apart.obj: the surface falls into 2 parts that lie too far apart for one cage; ..."},
        {"mesh tree.h5 -o x.h5", 1, kind("tree.h5", "tree", "body")},
        {"modes none.h5", 1, "none.h5: no such file"},
        {"modes dir", 1, "dir: is a folder; " + ours},
        {"modes text.h5", 1, "text.h5: is not an HDF5 file; " + ours},
        {"modes half_box.h5", 1, "half_box.h5" + cut},
        {"dataset tree.h5 -o x.h5", 1, kind("tree.h5", "tree", "body")},
        {"train box.h5 text.h5 -o x.h5", 1, "text.h5: is not an HDF5 file; " + ours},
        {"train box.h5 half_data.h5 -o x.h5", 1, "half_data.h5" + cut},
        {"train box.h5 tree.h5 -o x.h5", 1, kind("tree.h5", "tree", "recording")},
        {"train still.h5 data.h5 -o x.h5", 1,
         "still.h5: has no modes, which nbd bounds need; compute them with: nbdtree modes still.h5"},
        {"transfer data.h5 box.h5 -o t.h5", 1, kind("data.h5", "recording", "tree")},
        {"evaluate half_tree.h5 data.h5", 1, "half_tree.h5" + cut},
        {"evaluate text.h5 data.h5", 1, "text.h5: is not an HDF5 file; " + ours},
        {"evaluate box.h5 data.h5", 1, kind("box.h5", "body", "tree")},
        {"inspect none.h5", 1, "none.h5: no such file"},
        {"inspect half_tree.h5", 1, "half_tree.h5" + cut},
    });
}

TEST_F(BadInputTest, RejectsOutputsThatCannotBeWritten) {
    const std::string nowhere = "none/x: cannot be written: there is no folder " + here("none");
    expect_refused({
        {"mesh box.obj -o none/x", 1, nowhere},
        {"mesh box.obj -o dir", 1, "dir: cannot be written: it is a folder"},
        {"dataset box.h5 -o x.h5 --csv x.h5", 1,
         "x.h5: cannot be written: dataset and csv are the same file"},
        {"mesh box.obj -q -o /proc/x", 1, "/proc/x: cannot ..."},
        {"mesh box.obj -o /dev/full", 1,
         "/dev/full: cannot be written: it is not an ordinary file; allowed: a file"},
        {"mesh box.obj -o box.obj", 1, "box.obj: cannot be written: the command also reads this file"},
        {"dataset box.h5 -o dir/../box.h5", 1,
         "dir/../box.h5: cannot be written: the command also reads this file"},
        {"train box.h5 data.h5 -o none/x", 1, nowhere},
        {"evaluate tree.h5 data.h5 --csv none/x", 1, nowhere},
        {"modes box.h5 --csv none/x", 1, nowhere},
        {"collide box.obj box.obj --pairs none/x", 1, nowhere},
    });
}

TEST_F(BadInputTest, RejectsInvalidPosesOfCollide) {
    expect_refused({
        {"collide tree.h5 box.obj", 1,
         "tree.h5: unknown kind of surface file \".h5\"; allowed: .obj .ply .stl .off .glb"},
        {"collide none.h5@box.obj box.obj", 1, "none.h5: no such file"},
        {"collide tree.h5@ box.obj", 1, "'tree.h5@': a name is empty; allowed: SURFACE or TREE.h5@POSE"},
        {"collide @box.obj box.obj", 1, "'@box.obj': a name is empty; allowed: SURFACE or TREE.h5@POSE"},
        {"collide tree.h5@none.obj box.obj", 1, "none.obj: no such file"},
        {"collide tree.h5@sheet.obj box.obj", 1, "sheet.obj: its 1 faces are not those of the tree (108)"},
        {"collide tree.h5@data.h5:9:0 box.obj", 1, "data.h5: no trajectory 9, it has 3"},
        {"collide tree.h5@data.h5:0:50 box.obj", 1, "data.h5: no frame 50 in trajectory 0, it has 50"},
        {"collide tree.h5@data.h5:0 box.obj", 1, "data.h5:0: no such file"},
    });
}

TEST_F(BadInputTest, RejectsInvalidScenes) {
    const auto scene = [](const std::string& body) {
        static int count = 0;
        const std::string name = "scene" + std::to_string(count++) + ".json";
        write(name, R"({"bodies": [)" + body + "]}");
        return "simulate " + name + " -o x.h5";
    };
    const auto said = [](int number, const std::string& error) {
        return "scene" + std::to_string(number) + ".json: " + error;
    };
    expect_refused({
        {scene(R"({"body": "box.h5", "velosity": [0, 0, 1]})"), 1,
         said(0, R"(bodies[0]: unknown key "velosity"; the nearest known one is "velocity")")},
        {scene(R"({"body": "box.h5", "margin": "wide"})"), 1,
         said(1, R"(bodies[0].margin: must be a number, not "wide")")},
        {scene(R"({"body": "none.h5"})"), 1, "none.h5: no such file"},
        {scene(R"({"body": "other.h5", "tree": "tree.h5"})"), 1,
         "tree.h5: this tree belongs to another body than other.h5"},
        {scene(R"({"body": "box.h5", "bounds": "nbd"})"), 1,
         said(4,
              R"(bodies[0].tree: is missing: bounds "nbd" are learned or precomputed and need a tree file)")},
        {scene(R"({"body": "box.h5", "bounds": "boxs"})"), 1,
         said(5,
              R"(bodies[0].bounds: is "boxs", but must be exact, boxes, bd, nbd, learned_affine, affine or )"
              R"(auto; the nearest is "boxes")")},
        {scene(""), 1, said(6, "bodies: must hold at least one body")},
        {scene("{"), 1, said(7, "line 1, column ...")},
        {scene(R"({"body": "box.h5", "material": {"law": "neo_hookean"}})"), 1,
         said(8, R"(bodies[0].material.law: is "neo_hookean", but must be corotated, stable_neo_hookean or )"
                 R"(st_venant_kirchhoff; the nearest is "stable_neo_hookean")")},
        {scene(R"({"body": "box.h5", "material": {"law": 3}})"), 1,
         said(9,
              "bodies[0].material.law: is 3, but must be corotated, stable_neo_hookean or "
              "st_venant_kirchhoff")},
        {"simulate none.json -o x.h5", 1, "none.json: no such file"},
        {"simulate dir -o x.h5", 1, "dir: cannot be read: it is a folder"},
        {"simulate /dev/zero -o x.h5", 1,
         "/dev/zero: cannot be read: it is a special file; allowed: a regular file"},
    });
    write("good.json", R"({"bodies": [{"body": "box.h5"}]})");
    const std::string simulate = "simulate good.json -o ";
    const std::string replaced = "; allowed: a recording of a scene, which is replaced, or another name";
    const std::filesystem::directory_iterator shards(folder() / "data.shards");
    const auto first = std::find_if(begin(shards), end(shards),
                                    [](const auto& entry) { return entry.path().extension() == ".h5"; });
    ASSERT_NE(first, end(shards));
    const std::string shard = "data.shards/" + first->path().filename().string();
    expect_refused({
        {simulate + "x.h5 --bounds foo", 2, foo_bounds},
        {"simulate good.json -o x.h5 --bounds affine --margin 0.1", 1,
         "bodies[0] (box): margin is 0.1, but exact boxes take none"},
        {simulate + "x.h5 --bounds nbd", 1, "bodies[0] (box): bounds \"nbd\" need a tree"},
        {simulate + "x.h5 --frames 0", 2, "--frames: is '0'; allowed: a whole number from 1 to 10000000"},
        {simulate + "x.h5 --audit 2.5", 2, "--audit: is '2.5'; allowed: a whole number >= 0"},
        {simulate + "x.h5 --margin nan", 2, "--margin: is 'nan'; allowed: a number >= 0 and <= 10"},
        {simulate + "x.h5 --picture dir", 1, "dir: cannot be written: it is a folder"},
        {simulate + "x.h5 --vtu box.h5", 1,
         "box.h5: cannot be written: " + here("box.h5") + " is not a folder"},
        {simulate + "box.h5 --frames 1", 1, "box.h5: cannot be written: the command also reads this file"},
        {simulate + "other.h5 --frames 1", 1,
         "other.h5: cannot be written: it is a file of format 'nbdtree body'" + replaced},
        {simulate + "tree.h5 --frames 1", 1,
         "tree.h5: cannot be written: it is a file of format 'nbdtree tree'" + replaced},
        {simulate + "data.h5 --frames 1", 1, "data.h5: cannot be written: it is a dataset" + replaced},
        {simulate + shard + " --frames 1", 1,
         shard + ": cannot be written: it is a part of a dataset" + replaced},
        {simulate + "text.h5 --frames 1", 1,
         "text.h5: cannot be written: it holds what nbdtree did not write, or is damaged" + replaced},
    });
}

}  // namespace
}  // namespace nbd::test
