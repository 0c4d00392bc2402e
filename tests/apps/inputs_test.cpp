// Inputs that used to go wrong.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "meshing/body/body.hpp"
#include "meshing/formats/read_surface.hpp"
#include "meshing/formats/write_surface.hpp"
#include "tests/apps/small_files.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "training/files/recording.hpp"

namespace nbd {
namespace {

using namespace test;
using nlohmann::json;
using testing::HasSubstr;

class Inputs : public BoxFolder {
 protected:
    /// An OBJ file in full precision.
    static void write_obj(const std::string& name, const TriMesh& mesh) {
        std::string content;
        for (int v = 0; v < mesh.X.rows(); ++v)
            content += fmt::format("v {} {} {}\n", mesh.X(v, 0), mesh.X(v, 1), mesh.X(v, 2));
        for (int f = 0; f < mesh.F.rows(); ++f)
            content += fmt::format("f {} {} {}\n", mesh.F(f, 0) + 1, mesh.F(f, 1) + 1, mesh.F(f, 2) + 1);
        write(name, content);
    }

    static TriMesh away(TriMesh mesh) {
        mesh.X.rowwise() += Eigen::RowVector3d(500'000, 5'400'000, 300);
        return mesh;
    }
};

TEST_F(Inputs, CollideFindsThePairsOfSurfacesNearZeroAtGeographicCoordinates) {
    const TriMesh a = torus(1, 0.3, 40, 20), b = moved(torus(1, 0.25, 30, 20), 0.61, 0.17, 0.03, 0.9);
    write_obj("near_a.obj", a);
    write_obj("near_b.obj", b);
    write_obj("far_a.obj", away(a));
    write_obj("far_b.obj", away(b));
    const json near = result("collide near_a.obj near_b.obj"), far = result("collide far_a.obj far_b.obj");
    ASSERT_GT(near["face_pairs"], 50);
    EXPECT_EQ(far["face_pairs"], near["face_pairs"]);
    EXPECT_EQ(near["origin"], (std::vector<double>{0, 0, 0}));
    EXPECT_NE(far["origin"], near["origin"]);
    EXPECT_EQ(near["a_in_b"], "no");
}

TEST_F(Inputs, CollideTellsWhatLiesInside) {
    write_obj("large.obj", icosphere(3));
    write_obj("small.obj", moved(icosphere(2), 0.1, 0, 0, 0.2));
    EXPECT_THAT(
        text("collide small.obj large.obj"),
        testing::AllOf(HasSubstr("0 face pairs intersect"), HasSubstr("small.obj lies inside large.obj\n")));
    const json turned = result("collide large.obj small.obj");
    EXPECT_EQ(turned["a_in_b"], "no");
    EXPECT_EQ(turned["b_in_a"], "whole");
    EXPECT_EQ(result("collide large.obj small.obj --within 2")["b_in_a"], "whole");
    write_obj("crossing.obj", moved(icosphere(2), 1, 0, 0, 0.2));
    EXPECT_EQ(result("collide crossing.obj large.obj")["a_in_b"], "no");
    write_obj("two.obj", joined(moved(icosphere(2), 0.1, 0, 0, 0.2), moved(icosphere(2), 3, 0, 0, 0.2)));
    EXPECT_THAT(text("collide two.obj large.obj"), HasSubstr("a part of two.obj lies inside large.obj\n"));
}

TEST_F(Inputs, MeshScalesAPartInMillimetres) {
    TriMesh part = box(1000, 200, 100, 3);
    write_obj("mm.obj", part);
    part.X *= 0.001;
    write_obj("m.obj", part);
    make("mesh mm.obj -o mm.h5 --elements linear --scale 0.001");
    make("mesh m.obj -o m.h5 --elements linear");
    const Body scaled = load_body(folder() / "mm.h5"), plain = load_body(folder() / "m.h5");
    EXPECT_TRUE(scaled.tets.X.isApprox(plain.tets.X, 1e-12));
    make("mesh mm.h5 -o larger.h5 --scale 2");
    EXPECT_TRUE(load_body(folder() / "larger.h5").tets.X.isApprox(2 * scaled.tets.X, 1e-12));
    EXPECT_EQ(run("mesh mm.obj -o bad.h5 --scale 0").status, 2);
    // A scene names the factor where it names the file, and its body is the one that `mesh` makes: a tree
    // fits.
    make("dataset mm.h5 -o mm_poses.h5 --trajectories 3 --frames 20");
    make(
        "train mm.h5 mm_poses.h5 -o mm_tree.h5 --bounds learned_affine --depth 2 --held-out 0 --calibration 0");
    write("mm.json", R"({"bodies": [{"surface": "mm.obj", "meshing": {"scale": 0.001}, "tree": "mm_tree.h5",
        "bounds": "learned_affine", "margin": 0.1}], "time": {"frames": 1}})");
    EXPECT_EQ(text("validate mm.json"), "mm.json: valid\n");
}

TEST_F(Inputs, MeshWeldsWhereItIsToldAndSaysSoWhereASurfaceIsOpen) {
    const TriMesh whole = box(1, 1, 1, 3);
    TriMesh cracked{Nodes(3 * whole.F.rows(), 3), Faces(whole.F.rows(), 3)};
    for (int i = 0; i < whole.F.size(); ++i) {
        cracked.X.row(i) =
            whole.X.row(whole.F(i / 3, i % 3)) + 1e-6 * Eigen::RowVector3d(i % 3, i % 2, i % 5);
        cracked.F(i / 3, i % 3) = i;
    }
    write_obj("cracked.obj", cracked);
    EXPECT_THAT(
        error("mesh cracked.obj -o cracked.h5"),
        testing::AllOf(HasSubstr("the surface is open"), HasSubstr("--weld LENGTH"), HasSubstr("--cage")));
    EXPECT_THAT(text("mesh cracked.obj -o cracked.h5 --weld 1e-4"),
                HasSubstr("welded within 0.0001 m: 266 vertices merged"));
    EXPECT_EQ(load_body(folder() / "cracked.h5").surface.X.rows(), whole.X.rows());
}

TEST_F(Inputs, MeshSaysWhatWeldingAndScalingDid) {
    write_obj("cube.obj", box(1, 1, 1, 2));
    EXPECT_THAT(
        error("mesh cube.obj -o cube.h5 --weld 1e9"),
        HasSubstr("; welding within 1e+09 m merged 25 of 26 vertices and dropped 48 of 48 faces: choose a "
                  "shorter length"));
    TriMesh large = box(1, 1, 1, 2);
    large.X *= 1e20;
    write_obj("large.obj", large);
    EXPECT_THAT(error("mesh large.obj -o cube.h5 --scale 1e30"),
                HasSubstr("; the scale 1e+30 makes it 1e+50 m long: choose another"));
}

TEST_F(Inputs, MeshNamesAWayOutWhereTheSurfaceIsTooCoarseForTheNodes) {
    write_obj("coarse.obj", box(1, 1, 1, 1));
    EXPECT_THAT(error("mesh coarse.obj -o coarse.h5 --nodes 1000"),
                testing::AllOf(
                    HasSubstr("1000 nodes are not possible; allowed for a surface of 8 vertices: about 8 to"),
                    HasSubstr("for more nodes give a surface of more faces"), HasSubstr("--cage N")));
    write_obj("fine.obj", box(1, 1, 1, 8));
    EXPECT_THAT(error("mesh fine.obj -o fine.h5 --nodes 20"),
                HasSubstr("for fewer nodes give a surface of fewer faces"));
}

TEST_F(Inputs, SuggestOurNamesOfMaterialKeys) {
    write("names.json", R"({"bodies": [{"body": "box.h5", "material": {"E": 1e5, "nu": 0.3, "rho": 1000,
        "youngs_modulus": 1e5}}]})");
    const Ran ran = run("validate names.json");
    for (const auto& [word, key] :
         {std::pair("E", "young"), {"nu", "poisson"}, {"rho", "density"}, {"youngs_modulus", "young"}})
        EXPECT_THAT(ran.out,
                    HasSubstr(fmt::format("unknown key \"{}\"; the nearest known one is \"{}\"", word, key)));
}

TEST_F(Inputs, ObstaclesThatAreInsideOutAreTurnedAndTold) {
    TriMesh block = moved(box(1, 1, 0.2, 2), -0.5, -0.5, -0.21);
    write_obj("block.obj", block);
    block.F.col(1).swap(block.F.col(2));
    write_obj("flipped.obj", block);
    const auto scene = [](const std::string& mesh) {
        return R"({"bodies": [{"body": "box.h5", "transform": {"translate": [0, 0, 0.1]}}],
            "obstacles": [{"mesh": {"file": ")" +
               mesh + R"("}}], "time": {"frames": 30}})";
    };
    write("flipped.json", scene("flipped.obj"));
    write("block.json", scene("block.obj"));
    const Ran checked = run("validate flipped.json");
    EXPECT_EQ(checked.status, 0) << checked.out;
    EXPECT_THAT(checked.err, HasSubstr("flipped.obj: all of its 48 faces looked inward and were turned"));
    EXPECT_EQ(run("validate block.json").err, "");
    const Ran ran = run("simulate flipped.json -o flipped.h5 --json");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.err, HasSubstr("looked inward and were turned"));
    make("simulate block.json -o block_run.h5");
    Vertices turned, plain;
    RecordingReader(folder() / "flipped.h5").read(0, 30, 1, turned);
    RecordingReader(folder() / "block_run.h5").read(0, 30, 1, plain);
    EXPECT_TRUE(turned.isApprox(plain, 5e-4f));  // the corners of its faces have another order
    EXPECT_GT(plain.col(2).minCoeff(), -0.02f) << "the body lies on the block";
}

TEST_F(Inputs, FileNamesKeepLettersBeyondAscii) {
    write("names.json", R"({"bodies": [{"body": "box.h5", "name": "würfel a/b"}], "time": {"frames": 1}})");
    make("simulate names.json -o names.h5 --obj names");
    EXPECT_EQ(listing(folder() / "names"),
              (std::set<std::string>{"0_würfel_a_b_000000.obj", "0_würfel_a_b_000001.obj"}));
}

/// The scene of a box on a plane and an obstacle, all moved by 1000 km in x and -800 km in y.
std::string far_scene(const std::string& body, double x, double y) {
    return fmt::format(
        R"({{"bodies": [{{{}, "transform": {{"translate": [{}, {}, 0.06]}}, "velocity": [1, 0, 0]}}],
        "obstacles": [{{"plane": {{"point": [{}, {}, 0]}}}}], "time": {{"frames": 12}}}})",
        body, x, y, x, y);
}

TEST_F(Inputs, AFarSceneIsSimulatedAndRecordedAsNearZero) {
    write("near.json", far_scene(R"("body": "box.h5")", 0, 0));
    write("far.json", far_scene(R"("body": "box.h5")", 1e6, -8e5));
    make("simulate near.json -o near.h5");
    const Ran ran = run("simulate far.json -o far.h5 --obj far_obj --vtu far_vtu");
    ASSERT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.err, testing::Not(HasSubstr("thousandth")));
    const RecordingReader near(folder() / "near.h5"), far(folder() / "far.h5");
    EXPECT_EQ(near.origin(), Eigen::Vector3d::Zero());
    EXPECT_LT((far.origin() - Eigen::Vector3d(1e6, -8e5, 0)).norm(), 2);
    Vertices x, y, start;
    near.read(0, 0, 1, start);
    near.read(0, 12, 1, x);
    far.read(0, 12, 1, y);
    EXPECT_GT((x - start).cwiseAbs().maxCoeff(), 0.02);
    const Nodes world = y.cast<double>().rowwise() + far.origin().transpose();
    EXPECT_LT(((world.rowwise() - Eigen::RowVector3d(1e6, -8e5, 0)) - x.cast<double>()).cwiseAbs().maxCoeff(),
              1e-6);
    // Other programs get positions in the world.
    std::set<std::string> surfaces = listing(folder() / "far_obj");
    const TriMesh surface = read_surface(folder() / "far_obj" / *surfaces.rbegin());
    EXPECT_LT((surface.X.colwise().minCoeff() - world.colwise().minCoeff()).norm(), 1e-6);
    make("mesh far_vtu/scene_000012.vtu -o from_vtu.h5");
    const Body body = load_body(folder() / "from_vtu.h5");
    EXPECT_LT((body.tets.X.rowwise() + body.origin.transpose() - world).cwiseAbs().maxCoeff(), 1e-6);
    make("export far.h5 --gltf far.glb");
    EXPECT_LT((read_surface(folder() / "far.glb").X.colwise().minCoeff().transpose() - far.origin()).norm(),
              2);
}

TEST_F(Inputs, AFarBodyIsTrainedOnAndEvaluatedAsNearZero) {
    const TriMesh near = box(0.4, 0.2, 0.1, 2);
    write_obj("near_box.obj", near);
    write_obj("far_box.obj", away(near));
    make("mesh near_box.obj -o near_box.h5 --elements linear");
    EXPECT_THAT(
        text("mesh far_box.obj -o far_box.h5 --elements linear"),
        HasSubstr("far from zero: the body's positions are counted from its origin (500000, 5400000, 300)"));
    const Body far = load_body(folder() / "far_box.h5");
    EXPECT_EQ(far.origin, Eigen::Vector3d(500'000, 5'400'000, 300));
    EXPECT_NEAR((far.tets.X - load_body(folder() / "near_box.h5").tets.X).cwiseAbs().maxCoeff(), 0, 1e-8);
    make("dataset far_box.h5 -o far_poses.h5 --trajectories 4 --frames 20");
    EXPECT_EQ(RecordingReader(folder() / "far_poses.h5").origin(), far.origin);
    make(
        "train far_box.h5 far_poses.h5 -o far_tree.h5 --bounds learned_affine --depth 2 --held-out 0 --calibration 0");
    make("evaluate far_tree.h5 far_poses.h5 --csv far_eval.csv");
    make("inspect --check far_poses.h5 --body far_box.h5");
    // A recorded pose and a surface at geographic coordinates are compared where they are.
    const json met = result("collide far_tree.h5@far_poses.h5:0:0 far_box.obj --within 0.05");
    EXPECT_GT(met["face_pairs"], 0);
    EXPECT_EQ(result("collide far_tree.h5@far_poses.h5:0:0 near_box.obj")["face_pairs"], 0);
}

TEST_F(Inputs, AGltfFileComesBackAsItWas) {
    write("turn.json", R"({"bodies": [{"body": "box.h5", "transform": {"translate": [0.1, 0.2, 0.3],
        "rotate": {"axis": [0, 1, 0], "degrees": 20}}}], "time": {"frames": 1}})");
    make("simulate turn.json -o turn.h5 --obj turn");
    make("export turn.h5 --gltf turn.glb");
    const TriMesh glb = read_surface(folder() / "turn.glb"),
                  obj = read_surface(folder() / "turn" / *listing(folder() / "turn").begin());
    EXPECT_EQ(glb.F.rows(), obj.F.rows());
    for (int f = 0; f < glb.F.rows(); ++f)
        for (int c = 0; c < 3; ++c)
            EXPECT_LT((glb.X.row(glb.F(f, c)) - obj.X.row(obj.F(f, c))).cwiseAbs().maxCoeff(), 1e-6);
}

}  // namespace
}  // namespace nbd
