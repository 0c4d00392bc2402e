#include "sim/scene/scene.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <regex>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "sim/json/json_object.hpp"
#include "tests/sim/scene/scene_text.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using nlohmann::json;
using test::complaint;
using test::with;

const std::string full = R"({
  "bodies": [
    {"body": "a.h5", "name": "first", "tree": "a_tree.h5", "bounds": "nbd", "margin": 0.02,
     "transform": {"translate": [1, 2, 3], "rotate": {"axis": [0, 0, 2], "degrees": 90}},
     "velocity": [0, 0, -1], "angular_velocity": [0, 3, 0], "material": {"young": 5e4, "poisson": 0.3, "law": "stable_neo_hookean"},
     "regions": [{"group": "core", "material": {"young": 1e6, "poisson": 0.2, "density": 1100}},
                 {"region": {"sphere": {"centre": [0, 0, 0], "radius": 1}}, "material": {"law": "st_venant_kirchhoff"}},
                 {"region": {"box": {"min": [0, 0, 0], "max": [1, 1, 1]}}}],
     "pins": [{"sphere": {"centre": [1, 2, 3], "radius": 0.1}},
              {"box": {"min": [7, 7, 7], "max": [8, 8, 8]}}],
     "grips": [{"region": {"sphere": {"centre": [5, 5, 5], "radius": 1}}}, {"region": {"box": {"min": [0, 0, 0], "max": [1, 1, 1]}}, "translate": [0, 0, 1],
                "rotate": {"axis": [1, 0, 0], "degrees": 180}, "duration": 2, "release": 3},
               {"region": {"sphere": {"centre": [7, 7, 7], "radius": 1}}, "take": 4, "centre": [1, 2, 3],
                "motion": [{"time": 4}, {"time": 5, "translate": [0, 0, 1], "rotate": {"axis": [0, 2, 0], "degrees": 720},
                            "scale": 2, "interpolation": "linear"}, {"time": 6, "translate": [0, 0, 2]}]}],
     "loads": [{"force": [1, 2, 3], "region": {"sphere": {"centre": [5, 5, 5], "radius": 1}}, "factor": [[0, 0], [1.5, 2]]},
               {"torque": [0, 0, 4], "region": {"box": {"min": [0, 0, 0], "max": [1, 1, 1]}}}, {"acceleration": [0, 5, 0]}, {"pressure": 600},
               {"gas": {"pressure": 2e5, "ambient": 1e5, "exponent": 1.4}, "cavity": 1}]},
    {"surface": "/abs/b.obj", "transform": {"scale": 0.5},
     "inertia": {"mass": 3, "centre": [0, 0, 1], "moments": [1, 2, 2.5], "products": [0.1, 0.2, 0.3]},
     "meshing": {"nodes": 500, "grading": 0.1, "subdivide": 2, "subdivision": "loop", "elements": "quadratic"}},
    {"tets": "c.msh", "meshing": {"subdivide": 1}}
  ],
  "obstacles": [{"name": "floor", "plane": {"normal": [0, 0, 3]}, "friction": 0.7},
                {"sphere": {"centre": [0, 0, 5], "radius": 2}, "velocity": [0, 1, 0], "start": 1, "stop": 2.5},
                {"mesh": {"file": "rock.obj", "transform": {"scale": 2}}},
                {"box": {"size": [1, 2, 3], "transform": {"scale": 2}}, "centre": [0, 1, 0],
                 "motion": [{"time": 1, "translate": [0, 0, 1]}]},
                {"cylinder": {"radius": 1, "length": 2, "segments": 12}},
                {"capsule": {"radius": 1, "length": 2}},
                {"heights": {"spacing": 0.5, "table": [[0, 1, 0], [0, 2, 0]]}},
                {"heights": {"size": [2, 3], "file": "hills.png", "lowest": -1, "highest": 1}}],
  "joints": [{"name": "neck", "bodies": ["first", "b"], "ball": {"point": [1, 2, 3]}, "strength": 5},
             {"body": "b", "hinge": {"point": [1, 0, 0], "axis": [0, 2, 0], "least": -90, "most": 45, "stiffness": 2, "rest": 10, "damping": 3}, "width": 0.2},
             {"body": "c", "slider": {"point": [0, 1, 0], "axis": [1, 0, 0], "motor": [[0, 0], [2, 1]]}},
             {"bodies": ["b", "c"], "weld": {"region": {"box": {"min": [0, 0, 0], "max": [1, 1, 1]}}}, "meet": true},
             {"bodies": ["c", "b"], "weld": {"region": {"sphere": {"centre": [0, 0, 0], "radius": 1}}}},
             {"bodies": ["b", "c"], "spring": {"from": [0, 0, 1], "to": [0, 0, 2], "stiffness": 7, "damping": 1, "length": 0.5}},
             {"body": "b", "rope": {"from": [0, 0, 1], "to": [0, 0, 2], "stiffness": 8, "damping": 2, "length": 1.5}}],
  "gravity": [0, -9.81, 0],
  "contact": {"stiffness_scale": 2, "friction": 0.1, "thickness": 0.005,
    "pairs": [{"bodies": ["first", "c"], "friction": 0.3}, {"bodies": ["b", "b"], "meet": false},
              {"body": "first", "obstacle": "floor", "friction": 0.2}, {"body": "b", "obstacle": "obstacles[1]", "meet": false}]},
  "solver": {"integrator": "backward_euler", "tangent": "full", "newton_iterations": 3, "newton_tolerance": 0.01, "max_substeps": 4},
  "time": {"dt": 0.01, "frames": 7, "steps_per_frame": 3},
  "output": {"recording": "out/a.h5", "csv": "a.csv", "reactions": "forces.csv", "vtu": "frames", "obj": "frames", "picture": "a.png"},
  "seed": 42
})";

TEST(Scene, ReadsEveryKey) {
    const SceneSpec spec = parse_scene(full, "folder");
    ASSERT_EQ(spec.bodies.size(), 3u);
    const SceneBody& a = spec.bodies[0];
    EXPECT_EQ(a.file, std::filesystem::path("folder/a.h5"));
    EXPECT_EQ(a.source, BodySource::body);
    EXPECT_EQ(a.name, "first");
    EXPECT_EQ(a.tree, std::filesystem::path("folder/a_tree.h5"));
    EXPECT_EQ(a.bounds, BoundKind::nbd);
    EXPECT_EQ(a.margin, 0.02);
    EXPECT_EQ(a.velocity, Eigen::Vector3d(0, 0, -1));
    EXPECT_EQ(a.angular_velocity, Eigen::Vector3d(0, 3, 0));
    EXPECT_LT((a.placement.rotation() * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-12);
    Material material;
    a.material.apply(material);
    EXPECT_DOUBLE_EQ(material.young, 5e4);
    EXPECT_DOUBLE_EQ(material.poisson, 0.3);
    EXPECT_DOUBLE_EQ(material.density, Material{}.density);
    EXPECT_EQ(material.law, MaterialLaw::stable_neo_hookean);
    ASSERT_EQ(a.regions.size(), 3u);
    EXPECT_EQ(std::get<NamedGroup>(a.regions[0].where.part).name, "core");
    EXPECT_EQ(a.regions[0].material.density, 1100);
    EXPECT_TRUE(std::holds_alternative<BallShape>(a.regions[1].where.part));
    EXPECT_EQ(a.regions[1].material.law, MaterialLaw::st_venant_kirchhoff);
    EXPECT_EQ(std::get<Eigen::AlignedBox3d>(a.regions[2].where.part).max(), Eigen::Vector3d(1, 1, 1));
    EXPECT_EQ(spec.step.integrator, TimeIntegrator::backward_euler);
    EXPECT_EQ(spec.step.tangent, Tangent::full);
    ASSERT_EQ(a.grips.size(), 5u);  // pins first
    EXPECT_DOUBLE_EQ(std::get<BallShape>(a.grips[0].region.part).radius, 0.1);
    EXPECT_NEAR(a.grips[3].grip.motion.keyframes.back().rotation.x(), 3.14159265, 1e-8);
    EXPECT_DOUBLE_EQ(a.grips[3].grip.release, 3);
    const Grip& later = a.grips[4].grip;
    EXPECT_EQ(later.take, 4);
    EXPECT_EQ(later.motion.centre, Eigen::Vector3d(1, 2, 3));
    ASSERT_EQ(later.motion.keyframes.size(), 3u);
    const Keyframe &turned = later.motion.keyframes[1], &last = later.motion.keyframes[2];
    EXPECT_LT((turned.rotation - Eigen::Vector3d(0, 4 * std::numbers::pi, 0)).norm(), 1e-12);
    EXPECT_EQ(turned.to_next, Interpolation::linear);
    EXPECT_EQ(last.to_next, Interpolation::smooth);
    EXPECT_EQ(last.translation, Eigen::Vector3d(0, 0, 2));
    EXPECT_EQ(last.rotation, turned.rotation) << "as in the keyframe before";
    EXPECT_EQ(last.scale, 2);
    ASSERT_EQ(a.loads.size(), 5u);
    EXPECT_EQ(a.loads[0].load.kind, LoadKind::force);
    EXPECT_EQ(a.loads[0].load.value, Eigen::Vector3d(1, 2, 3));
    ASSERT_TRUE(a.loads[0].region);
    EXPECT_EQ(a.loads[0].load.factor.times, (std::vector<double>{0, 1.5}));
    EXPECT_EQ(a.loads[0].load.factor.values, (std::vector<double>{0, 2}));
    EXPECT_EQ(a.loads[1].load.kind, LoadKind::torque);
    EXPECT_FALSE(a.loads[2].region);
    EXPECT_EQ(a.loads[2].load.kind, LoadKind::acceleration);
    EXPECT_EQ(a.loads[3].load.kind, LoadKind::pressure);
    EXPECT_EQ(a.loads[3].load.pressure, 600);
    EXPECT_FALSE(a.loads[3].cavity);
    EXPECT_EQ(a.loads[4].load.kind, LoadKind::gas);
    EXPECT_EQ(a.loads[4].cavity, 1);
    EXPECT_EQ(a.loads[4].load.gas.pressure, 2e5);
    EXPECT_EQ(a.loads[4].load.gas.ambient, 1e5);
    EXPECT_EQ(a.loads[4].load.gas.exponent, 1.4);
    const SceneBody& b = spec.bodies[1];
    EXPECT_EQ(b.source, BodySource::surface);
    EXPECT_EQ(b.meshing.tets.nodes, 500);
    EXPECT_DOUBLE_EQ(b.meshing.tets.grading, 0.1);
    EXPECT_EQ(b.meshing.levels, 2);
    EXPECT_EQ(b.meshing.elements, Elements::quadratic);
    EXPECT_EQ(spec.bodies[2].meshing.elements, std::nullopt);
    EXPECT_EQ(b.meshing.scheme, SubdivisionScheme::loop);
    EXPECT_EQ(b.file, std::filesystem::path("/abs/b.obj"));
    EXPECT_EQ(b.name, "b");
    EXPECT_EQ(b.bounds, BoundKind::automatic);
    EXPECT_EQ(spec.bodies[2].source, BodySource::tets);
    EXPECT_EQ(spec.bodies[2].meshing.levels, 1);
    ASSERT_EQ(spec.obstacles.size(), 8u);
    EXPECT_EQ(std::get<PlaneShape>(spec.obstacles[0].obstacle.shape).normal, Eigen::Vector3d::UnitZ());
    EXPECT_DOUBLE_EQ(spec.obstacles[0].obstacle.friction, 0.7);
    EXPECT_DOUBLE_EQ(std::get<BallShape>(spec.obstacles[1].obstacle.shape).radius, 2);
    EXPECT_EQ(spec.obstacles[2].mesh, std::filesystem::path("folder/rock.obj"));
    EXPECT_EQ(spec.obstacles[3].made.X.colwise().maxCoeff(), Eigen::RowVector3d(0.5, 1, 1.5));
    EXPECT_EQ(spec.obstacles[3].obstacle.motion.centre, Eigen::Vector3d(0, 1, 0));
    EXPECT_EQ(spec.obstacles[4].made.X.rows(), 26);
    EXPECT_EQ(spec.obstacles[6].made.X.row(4), Eigen::RowVector3d(0.5, 0.5, 2));
    ASSERT_TRUE(spec.obstacles[7].heights);
    EXPECT_EQ(spec.obstacles[7].heights->file, std::filesystem::path("folder/hills.png"));
    EXPECT_EQ(spec.obstacles[7].heights->size, Eigen::Vector2d(2, 3));
    ASSERT_EQ(spec.joints.size(), 7u);
    EXPECT_EQ(spec.joints[0].joint.name, "neck");
    EXPECT_EQ(spec.joints[0].joint.a, 0);
    EXPECT_EQ(spec.joints[0].joint.b, 1);
    EXPECT_EQ(spec.joints[0].joint.strength, 5);
    EXPECT_EQ(spec.joints[1].joint.name, "joints[1]");
    EXPECT_EQ(spec.joints[1].joint.b, -1);
    const HingeJoint& hinge = std::get<HingeJoint>(spec.joints[1].joint.kind);
    EXPECT_DOUBLE_EQ(*hinge.angle.most, std::numbers::pi / 4);
    EXPECT_DOUBLE_EQ(hinge.angle.rest, std::numbers::pi / 18);
    EXPECT_EQ(std::get<SliderJoint>(spec.joints[2].joint.kind).way.motor.at(1, 0), 0.5);
    EXPECT_TRUE(spec.joints[3].joint.bodies_meet);
    EXPECT_TRUE(spec.joints[3].region);
    EXPECT_EQ(std::get<CordJoint>(spec.joints[5].joint.kind).stiffness, 7);
    EXPECT_TRUE(std::get<CordJoint>(spec.joints[6].joint.kind).pulls_only);
    EXPECT_EQ(spec.gravity, Eigen::Vector3d(0, -9.81, 0));
    EXPECT_DOUBLE_EQ(spec.contact.thickness, 0.005);
    ASSERT_EQ(spec.pairs.size(), 4u);
    const auto expect_pair = [&](std::size_t i, int a, int b, bool meets, std::optional<double> friction) {
        EXPECT_EQ(spec.pairs[i].a, a) << i;
        EXPECT_EQ(spec.pairs[i].b, b) << i;
        EXPECT_EQ(spec.pairs[i].rule.meets, meets) << i;
        EXPECT_EQ(spec.pairs[i].rule.friction, friction) << i;
    };
    expect_pair(0, 0, 2, true, 0.3);
    expect_pair(1, 1, 1, false, std::nullopt);
    expect_pair(2, 0, party_of_obstacle(0), true, 0.2);
    expect_pair(3, 1, party_of_obstacle(1), false, std::nullopt);
    EXPECT_EQ(spec.obstacles[0].name, "floor");
    EXPECT_EQ(spec.obstacles[2].name, "obstacles[2]");
    const std::vector<Keyframe>& moves = spec.obstacles[1].obstacle.motion.keyframes;
    ASSERT_EQ(moves.size(), 2u);
    EXPECT_EQ(moves[0].time, 1);
    EXPECT_EQ(moves[1].time, 2.5);
    EXPECT_EQ(spec.step.newton_iterations, 3);
    EXPECT_EQ(spec.step.newton_tolerance, 0.01);
    EXPECT_EQ(spec.step.max_substeps, 4);
    EXPECT_DOUBLE_EQ(spec.time.dt, 0.01);
    EXPECT_EQ(spec.time.frames, 7);
    EXPECT_EQ(spec.time.steps_per_frame, 3);
    EXPECT_EQ(spec.output.recording, std::filesystem::path("out/a.h5"));
    EXPECT_EQ(spec.output.csv, std::filesystem::path("a.csv"));
    EXPECT_EQ(spec.output.reactions, std::filesystem::path("forces.csv"));
    EXPECT_EQ(spec.output.vtu, std::filesystem::path("frames"));
    EXPECT_EQ(spec.output.obj, std::filesystem::path("frames"));
    EXPECT_EQ(spec.output.picture, std::filesystem::path("a.png"));
    EXPECT_EQ(spec.seed, 42u);
}

TEST(Scene, ExamplesAreValid) {
    int examples = 0;
    for (const auto& entry : std::filesystem::directory_iterator(NBD_ASSETS "/scenes")) {
        if (entry.path().extension() != ".json") continue;
        const SceneSpec spec = load_scene(entry.path());
        for (const SceneBody& body : spec.bodies)
            EXPECT_TRUE(body.source == BodySource::body || std::filesystem::exists(body.file)) << body.file;
        ++examples;
    }
    EXPECT_GE(examples, 3);
    EXPECT_EQ(load_scene(NBD_ASSETS "/scenes/demo/demo.json").bodies.size(), 2u);  // its files are made later
}

struct Broken {
    std::string text, message;
};

class BrokenScene : public ::testing::TestWithParam<Broken> {};

TEST_P(BrokenScene, IsRejectedInOneLine) { EXPECT_EQ(complaint(GetParam().text), GetParam().message); }

const std::string one_source = R"(bodies[0]: needs exactly one of "body", "surface" and "tets")";

const Broken broken_scenes[] = {
    {"[]", "the scene must be an object, not []"},
    {"{}", "bodies: is missing"},
    {R"({"Bodies": []})", "bodies: is missing; the nearest key there is \"Bodies\""},
    {R"({"bodies": [{"Body": "a"}]})", one_source + "; the nearest key there is \"Body\""},
    {R"({"gravity": [0, 0, 0]})", "bodies: is missing"},
    {R"({"bodies": []})", "bodies: must hold at least one body"},
    {R"({"bodies": {}})", "bodies: must be an array, not {}"},
    {R"({"bodies": [3]})", "bodies[0]: must be an object, not 3"},
    {R"({"bodies": [{}]})", one_source},
    {R"({"bodies": [{"body": "a", "surface": "b"}]})", one_source},
    {R"({"bodies": [{"body": ""}]})", "bodies[0].body: must not be empty"},
    {R"({"bodies": [{"body": 5}]})", "bodies[0].body: must be a text, not 5"},
    {with(R"("trasform": {})"),
     "bodies[0]: unknown key \"trasform\"; the nearest known one is \"transform\""},
    {with("", R"("gravty": 1)"), "unknown key \"gravty\"; the nearest known one is \"gravity\""},
    {with("", R"("solver": {"most_substeps": 4})"), "solver.most_substeps: is gone; write \"max_substeps\""},
    {with(R"("bounds": "modal")", ""), "bodies[0].bounds: is \"modal\", which is gone; write \"nbd\""},
    {with("", R"("time": {"Dt": 1})"), "time: unknown key \"Dt\"; the nearest known one is \"dt\""},
    {with("", R"("time": {"dt": 0})"), "time.dt: is 0, but must be between 1e-7 and 1"},
    {with("", R"("time": {"frames": 2.5})"), "time.frames: must be a whole number, not 2.5"},
    {with("", R"("time": {"frames": 0})"), "time.frames: is 0, but must be between 1 and 1000000"},
    {with("", R"("seed": -1)"), "seed: is -1, but must be between 0 and 9e15"},
    {with("", R"("gravity": [0, 0])"), "gravity: must be three numbers, not [0,0]"},
    {with("", R"("gravity": [0, 0, "down"])"), "gravity: must be three numbers, not [0,0,\"down\"]"},
    {with("", R"("contact": {"friction": -0.5})"), "contact.friction: is -0.5, but must be between 0 and 10"},
    {with("", R"("contact": 7)"), "contact: must be an object, not 7"},
    {with("", R"("obstacles": [{}])"),
     "obstacles[0]: needs exactly one of \"plane\", \"sphere\", \"box\", \"cylinder\", \"capsule\", "
     "\"heights\", \"mesh\" and \"recording\""},
    {with("", R"("obstacles": [{"plane": {"normal": [0, 0, 0]}}])"),
     "obstacles[0].plane.normal: must not be zero"},
    {with("", R"("obstacles": [{"sphere": {"centre": [0, 0, 0]}}])"),
     "obstacles[0].sphere.radius: is missing"},
    {with("", R"("obstacles": [{"sphere": {"radius": -2}}])"),
     "obstacles[0].sphere.radius: is -2, but must be between 1e-30 and 1e30"},
    {with(R"("material": {"young": 1e308})"),
     "bodies[0].material.young: is 1e+308, but must be between 1e-30 and 1e30"},
    {with(R"("material": {"rayleigh_stiffness": 1e308})"),
     "bodies[0].material.rayleigh_stiffness: is 1e+308, but must be between 0 and 1e30"},
    {with("", R"("obstacles": [{"mesh": {}}])"), "obstacles[0].mesh.file: is missing"},
    {with("", R"("obstacles": [{"mesh": {"file": ""}}])"), "obstacles[0].mesh.file: must not be empty"},
    {with(R"("bounds": "certified")"), "bodies[0].bounds: is \"certified\", which is gone; write \"affine\""},
    {with(R"("bounds": "tight")"),
     "bodies[0].bounds: is \"tight\", but must be exact, boxes, bd, nbd, learned_affine, affine or "
     "auto"},
    {with(R"("meshing": {"nodes": 9})"),
     "bodies[0].meshing: applies to surfaces and tetrahedra only; a body file is used unchanged"},
    {R"({"bodies": [{"tets": "a.msh", "meshing": {"nodes": 9}}]})",
     "bodies[0].meshing.nodes: applies to surfaces only; given tetrahedra are not remeshed"},
    {R"({"bodies": [{"surface": "a.obj", "meshing": {"subdivision": "butterfly"}}]})",
     "bodies[0].meshing.subdivision: is \"butterfly\", but must be midpoint or loop"},
    {with("", R"("output": {"vtk": "a"})"), "output: unknown key \"vtk\"; the nearest known one is \"vtu\""},
    {with("", R"("output": {"csv": ""})"), "output.csv: must not be empty"},
    {with("", R"("output": {"recording": "run"})"), "output.recording: is \"run\", but must end in .h5"},
    {with("", R"("output": {"csv": "run.txt"})"), "output.csv: is \"run.txt\", but must end in .csv"},
    {with("", R"("output": {"picture": "a.jpg"})"), "output.picture: is \"a.jpg\", but must end in .png"},
    {with("", R"("seed": 1, "seed": 2)"), "seed: this key occurs twice"},
    {with(R"("pins": [], "grips": [{}, {"start": 1, "start": 1}])"),
     "bodies[0].grips[1].start: this key occurs twice"},
    {with(R"("bounds": "nbd")"),
     "bodies[0].tree: is missing: bounds \"nbd\" are learned or precomputed and need a tree file"},
    {with(R"("bounds": "bd", "tree": "t.h5", "transform": {"scale": 2})"),
     "bodies[0].transform.scale: must be 1 unless bounds are \"auto\", \"affine\", \"boxes\" or \"exact\""},
    {with(R"("margin": "wide")"), "bodies[0].margin: must be a number, not \"wide\""},
    {with(R"("margin": -0.1)"), "bodies[0].margin: is -0.1, but must be between 0 and 10"},
    {with(R"("material": {"poisson": 0.5})"),
     "bodies[0].material.poisson: is 0.5, but must be between -0.999 and 0.4999"},
    {with(R"("material": {"young": 1e999})"), "number overflow parsing '1e999'"},
    {with(R"("pins": [{"box": {"min": [0, 0, 0]}}])"), "bodies[0].pins[0].box.max: is missing"},
    {with(R"("pins": [{}])"),
     R"(bodies[0].pins[0]: needs exactly one of "box", "sphere", "capsule", "near", "group", "nodes", "faces", "all", "any" and "not")"},
    {with(R"("pins": [{"box": {"min": [0, 0, 1], "max": [1, 1, 0]}}])"),
     "bodies[0].pins[0].box.max: must not be below \"min\""},
    {with(R"("grips": [{}])"), "bodies[0].grips[0].region: is missing"},
    {with(R"("grips": [{"region": {"sphere": {"radius": 1}}, "rotate": {"axis": [0, 0, 0]}}])"),
     "bodies[0].grips[0].rotate.axis: must not be zero"},
    {with(R"("grips": [{"region": {"sphere": {"radius": 1}}, "start": 5, "release": 1}])"),
     "bodies[0].grips[0].release: must not be before \"start\""},
};

INSTANTIATE_TEST_SUITE_P(All, BrokenScene, ::testing::ValuesIn(broken_scenes));

TEST(Scene, SyntaxErrorsNameLineAndColumn) {
    const std::string message = complaint("{\n  \"bodies\": [\n    {\"body\" \"a.h5\"}\n  ]\n}");
    EXPECT_EQ(message.rfind("line 3, column ", 0), 0u) << message;
    EXPECT_NE(message.find("syntax error"), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
    EXPECT_EQ(complaint("{"),
              "line 1, column 2: syntax error while parsing object key - unexpected end of input; expected "
              "string literal");
    EXPECT_EQ(complaint("{\"a\": \"x: y"),
              "line 1, column 12: syntax error while parsing value - invalid string: missing closing quote; "
              "last read: '\"x: y'");
}

TEST(Scene, ReportsTruncationAnywhereInOneLine) {
    ASSERT_EQ(complaint(full), "");
    for (std::size_t length = 0; length < full.size(); ++length) {
        const std::string message = complaint(full.substr(0, length));
        EXPECT_FALSE(message.empty()) << length;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
}

TEST(Scene, ReportsEveryProblemAtOnce) {
    const SceneReading reading = read_scene(R"({
        "bodies": [{"body": "a.h5", "nmae": "a", "velocity": 3}, {"body": "b.h5"}, {}],
        "obstacles": [{"plane": {"normal": "up"}}, {"sphere": {"radius": 1}}],
        "time": {"dt": -1}, "gravityy": 3})",
                                            "");
    EXPECT_EQ(reading.problems,
              (std::vector<std::string>{"bodies[0].velocity: must be three numbers, not 3",
                                        R"(bodies[0]: unknown key "nmae"; the nearest known one is "name")",
                                        R"(bodies[2]: needs exactly one of "body", "surface" and "tets")",
                                        R"(obstacles[0].plane.normal: must be three numbers, not "up")",
                                        "time.dt: is -1, but must be between 1e-7 and 1",
                                        R"(unknown key "gravityy"; the nearest known one is "gravity")"}));
    EXPECT_EQ(reading.body_is_good, (std::vector<bool>{false, true, false}));
    EXPECT_EQ(reading.obstacle_is_good, (std::vector<bool>{false, true}));
    EXPECT_EQ(reading.spec.bodies.size(), 3u);
}

TEST(Scene, SizesFilesByUnitsScaleAndStretch) {
    const auto meshing = [](const std::string& keys) {
        return R"({"bodies": [{"surface": "a.obj", "meshing": {)" + keys + "}}]}";
    };
    const auto sized = [&](const std::string& keys) -> Eigen::RowVector3d {
        return parse_scene(meshing(keys), "").bodies[0].meshing.sized(Nodes::Constant(1, 3, 10));
    };
    EXPECT_TRUE(sized(R"("units": "mm")").isApprox(Eigen::RowVector3d(0.01, 0.01, 0.01), 1e-14));
    EXPECT_TRUE(sized(R"("units": "in", "scale": 2, "stretch": [1, 2, 0.5])")
                    .isApprox(Eigen::RowVector3d(0.508, 1.016, 0.254), 1e-14));
    EXPECT_EQ(sized(R"("scale": 1)"), Eigen::RowVector3d(10, 10, 10));
    EXPECT_EQ(
        complaint(meshing(R"("units": "mmm")")),
        R"(bodies[0].meshing.units: is "mmm", but must be m, cm, mm, um, in or ft; the nearest is "mm")");
    EXPECT_EQ(complaint(meshing(R"("stretch": [1, 0, 1])")),
              "bodies[0].meshing.stretch: must be three numbers between 1e-30 and 1e30");
    EXPECT_EQ(complaint(meshing(R"("stretch": 2)")),
              "bodies[0].meshing.stretch: must be three numbers, not 2");
}

TEST(Scene, NamesAnUnreadableFileAndTheReason) {
    EXPECT_EQ(test::error_of<std::runtime_error>([] { load_scene("/nowhere/scene.json"); }),
              "/nowhere/scene.json: no such file");
    EXPECT_EQ(test::error_of<std::runtime_error>([] { load_scene("/proc"); }),
              "/proc: cannot be read: it is a folder");
}

/// The keys of a schema by their paths, with references resolved.
class SchemaKeys {
 public:
    explicit SchemaKeys(const json& schema) : root_(schema) { add(schema, ""); }
    std::map<std::string, json> keys;

 private:
    /// The schema of a value. A reference is replaced by its target, which the value's own keys override.
    json resolved(json schema) const {
        if (!schema.contains("$ref")) return schema;
        json target = root_.at(json::json_pointer(schema["$ref"].get<std::string>().substr(1)));
        schema.erase("$ref");
        target.update(schema);
        return resolved(target);
    }

    /// Regions may be made of regions, of which two levels tell all.
    static bool is_too_deep(const std::string& name) {
        const std::regex combination(R"(\.(all|any|not)(?=\[|\.|$))");
        return std::distance(std::sregex_iterator(name.begin(), name.end(), combination), {}) > 2;
    }

    void add(const json& object, const std::string& path) {
        const json schema = resolved(object);
        if (schema.contains("items")) add(schema["items"], path + "[]");
        if (!schema.contains("properties")) return;
        for (const auto& [key, value] : schema["properties"].items()) {
            const std::string name = path.empty() ? key : path + "." + key;
            if (is_too_deep(name)) continue;
            keys[name] = resolved(value);
            add(value, name);
        }
    }

    const json& root_;
};

/// What a schema should state about a field: type, range, choices, default.
json expected(const JsonField& field) {
    json schema;
    if (field.choices.empty())
        schema["type"] = field.type;
    else
        schema["enum"] = field.choices;
    if (field.range) {
        const auto [low, high, text] = *field.range;
        if (low > 0 && low < 1e-20)
            schema["exclusiveMinimum"] = 0;
        else if (low > -1e20)
            schema["minimum"] = low;
        if (high < 1e20) schema["maximum"] = high;
    }
    const bool is_plain =
        field.fallback.is_null() || field.fallback == "" ||
        (field.fallback.is_number_float() && !std::isfinite(field.fallback.get<double>())) ||
        field.fallback == json::array({0.0, 0.0, 0.0});
    if (!is_plain) schema["default"] = field.fallback;
    return schema;
}

/// Differences between a JSON schema and the fields that a reader accepts: missing keys, types, ranges,
/// choices and defaults. One line each; empty if they agree.
std::vector<std::string> schema_differences(const std::filesystem::path& schema,
                                            std::span<const JsonField> fields) {
    const json root = json::parse(std::ifstream(schema));
    const SchemaKeys published(root);
    std::vector<std::string> differences;
    std::set<std::string> read;
    for (const JsonField& field : fields) {
        const std::string name = field.object.empty() ? field.key : field.object + "." + field.key;
        if (!read.insert(name).second) continue;
        const auto found = published.keys.find(name);
        if (found == published.keys.end()) {
            differences.push_back(name + ": the schema lacks it");
            continue;
        }
        const json wanted = expected(field);
        for (const char* word : {"type", "enum", "minimum", "exclusiveMinimum", "maximum", "default"})
            if (wanted.value(word, json()) != found->second.value(word, json()))
                differences.push_back(name + ": " + word + " is " + found->second.value(word, json()).dump() +
                                      ", the parser has " + wanted.value(word, json()).dump());
    }
    for (const auto& [name, value] : published.keys)
        if (!read.contains(name)) differences.push_back(name + ": the parser lacks it");
    return differences;
}

/// Regions with all keys that there are.
std::vector<std::string> all_regions() {
    const std::vector<std::string> simple{R"({"box": {"min": [0, 0, 0], "max": [1, 1, 1]}})",
                                          R"({"sphere": {"centre": [0, 0, 0], "radius": 1}})",
                                          R"({"capsule": {"from": [0, 0, 0], "to": [0, 0, 1], "radius": 1}})",
                                          R"({"near": {"body": "a", "distance": 1}})",
                                          R"({"group": "core"})",
                                          R"({"nodes": [0, 7]})",
                                          R"({"faces": [3]})"};
    const auto combined = [](const std::vector<std::string>& regions) {
        std::vector<std::string> made;
        for (const std::string& one : regions) {
            made.push_back(R"({"not": )" + one + "}");
            for (const char* how : {"all", "any"}) made.push_back(fmt::format(R"({{"{}": [{}]}})", how, one));
        }
        return made;
    };
    std::vector<std::string> all = simple;
    const std::vector<std::string> once = combined(simple), twice = combined(once);
    all.insert(all.end(), once.begin(), once.end());
    all.insert(all.end(), twice.begin(), twice.end());
    return all;
}

TEST(Scene, AgreesWithThePublishedSchema) {
    std::vector<JsonField> fields = read_scene(full, "").fields;
    const SceneReading other =
        read_scene(with("", R"("gravity": [{"time": 0, "value": [0, 0, 0]}], "time": {"static": {}})"),
                   "");  // keys that have several forms
    fields.insert(fields.end(), other.fields.begin(), other.fields.end());
    const SceneReading variables = read_scene(
        with("",
             R"("variables": [{"name": "a", "uniform": [0, 1]}, {"log_uniform": [1, 2]}, {"integer": [0, 1]},
            {"choice": [1]}, {"direction": [0, 0, 1]}, {"rotation": "any"}])"),
        "");
    fields.insert(fields.end(), variables.fields.begin(), variables.fields.end());
    const SceneReading winds = read_scene(with(R"("loads": [{"wind": {"velocity": [0, 0, 1]}},
                          {"wind": {"velocity": [{"time": 0, "value": [0, 0, 1]}]}}])"),
                                          "");
    fields.insert(fields.end(), winds.fields.begin(), winds.fields.end());
    const SceneReading recorded =
        read_scene(with("", R"("obstacles": [{"recording": {"file": "r.h5", "body": "a.h5"}}])"), "");
    fields.insert(fields.end(), recorded.fields.begin(), recorded.fields.end());
    for (const std::string& region : all_regions()) {
        const std::string at = R"({"region": )" + region;
        const SceneReading places = read_scene(
            with(
                R"("pins": [)" + region + R"(], "grips": [)" + at + R"(}], "loads": [)" + at +
                    R"(, "force": [0, 0, 1]}], "muscles": [)" + at +
                    R"(, "direction": [1, 0, 0], "stress": 1, "factor": [[0, 1]]}, {"along": [[0, 0, 0], [1, 0, 0]], "stress": 1}], "friction": [)" +
                    at + R"(, "coefficient": 1}], "regions": [)" + at + "}]",
                R"("joints": [{"body": "a", "weld": )" + at +
                    R"(}}], "tendons": [{"name": "t", "through": [{"body": "a", "at": [0, 0, 0]}, {"at": [0, 0, 1]}], "force": 1, "factor": [[0, 1]]}])"),
            "");
        EXPECT_EQ(places.problems, std::vector<std::string>{}) << region;
        fields.insert(fields.end(), places.fields.begin(), places.fields.end());
    }
    const std::vector<std::string> differences =
        schema_differences(NBD_ASSETS "/scenes/schema/scene.schema.json", fields);
    EXPECT_EQ(differences, std::vector<std::string>{});
}

}  // namespace
}  // namespace nbd
