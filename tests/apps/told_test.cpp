// What the commands tell of motions that may be wrong: one line each, as warning, in --json, and as the error
// of a --strict run.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "meshing/body/make_body.hpp"
#include "tests/apps/small_files.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "training/files/recording.hpp"

namespace nbd {
namespace {

using test::Ran;
using testing::HasSubstr;

class Told : public test::BoxFolder {
 protected:
    static Ran simulate(const std::string& scene_and_options) {
        return run("simulate -o run.h5 " + scene_and_options);
    }

    /// A scene of the box at these places, of one step.
    static void write_scene(const std::string& name, const std::vector<std::string>& places,
                            const std::string& more = R"("obstacles": [{"plane": {}}])") {
        std::string bodies;
        for (std::size_t b = 0; b < places.size(); ++b)
            bodies +=
                fmt::format(R"({}{{"body": "box.h5", "name": "b{}", "transform": {{"translate": {}}}}})",
                            b > 0 ? ", " : "", b, places[b]);
        write(name,
              fmt::format(
                  R"({{"bodies": [{}], {}, "time": {{"dt": 1e-4, "frames": 1, "steps_per_frame": 1}}}})",
                  bodies, more));
    }

    /// Expects one warning from each command, in --json too, and with --strict the same line as the error.
    static void expect_told(const std::string& command, const std::string& line) {
        SCOPED_TRACE(command);
        const Ran told = run(command + " --json"), stopped = run(command + " --strict");
        EXPECT_EQ(told.status, 0);
        EXPECT_EQ(told.err, "nbdtree: warning: " + line + "\n");
        EXPECT_EQ(nlohmann::json::parse(told.out)["warnings"], std::vector<std::string>{line});
        EXPECT_EQ(stopped.status, 1);
        EXPECT_EQ(stopped.err, "nbdtree: error: " + line + "\n");
    }
};

const std::string way_out = "; \"resolve_start\": true moves bodies apart before the first step";

TEST_F(Told, StartsThatOverlapOrTouch) {
    write_scene("floor.json", {"[0, 0, -0.03]"});  // the box has a corner at the origin
    const std::string deep = "is 0.03 m deep in obstacles[0] at the start";
    const Ran floor = simulate("floor.json");
    EXPECT_EQ(floor.status, 1);
    EXPECT_EQ(floor.err, "nbdtree: error: floor.json: bodies[0] (b0): " + deep + way_out + "\n");
    EXPECT_THAT(run("validate floor.json").out, HasSubstr("floor.json: bodies[0]: " + deep + way_out));

    write_scene("two.json", {"[0, 0, 1]", "[0.1, 0.02, 1.03]"});
    const Ran two = simulate("two.json");
    EXPECT_EQ(two.status, 1);
    EXPECT_THAT(two.err, HasSubstr("two.json: bodies[1] (b1): overlaps bodies[0] (b0) at the start: "));
    EXPECT_THAT(two.err, HasSubstr("pairs of faces cross" + way_out));

    write("block.obj", test::obj_file(test::moved(test::box(1, 1, 1, 2), -0.5, -0.5, -1)));
    write_scene("mesh.json", {"[0, 0, -0.03]"}, R"("obstacles": [{"mesh": {"file": "block.obj"}}])");
    EXPECT_THAT(simulate("mesh.json").err, HasSubstr("mesh.json: bodies[0] (b0): " + deep + way_out));

    write("ball.obj", test::obj_file(test::moved(test::icosphere(2), 0, 0, 1)));
    write("inside.json", R"({"bodies": [{"surface": "ball.obj", "name": "ball"},
        {"body": "box.h5", "name": "box", "transform": {"translate": [0, 0, 1]}}],
        "time": {"dt": 1e-4, "frames": 1, "steps_per_frame": 1}})");
    EXPECT_THAT(
        simulate("inside.json").err,
        HasSubstr("bodies[1] (box): lies inside bodies[0] (ball) or encloses it at the start" + way_out));

    write_scene("touch.json", {"[0, 0, 0]"});
    const Ran touching = simulate("touch.json --strict");
    EXPECT_EQ(touching.status, 0);
    EXPECT_THAT(
        touching.err,
        HasSubstr(
            "bodies[0] (b0): touched or overlapped something at the start and was moved by (0, 0, 0.0"));
    const Ran checked = run("validate touch.json --strict");
    EXPECT_EQ(checked.status, 0);
    EXPECT_THAT(checked.err,
                testing::StartsWith("nbdtree: touch.json: bodies[0]: touched or overlapped something at the "
                                    "start and was moved by (0, 0, 0.0"));

    // Nothing is said of what is apart, or was moved apart.
    write_scene("apart.json", {"[0, 0, 0.01]", "[0, 0, 0.12]"});
    EXPECT_EQ(simulate("apart.json --strict").err, "");
    EXPECT_EQ(run("validate apart.json --strict").err, "");
    write_scene("moved.json", {"[0, 0, -0.03]"},
                R"("obstacles": [{"plane": {}}], "contact": {"resolve_start": true})");
    const Ran moved = simulate("moved.json --strict");
    EXPECT_EQ(moved.status, 0);
    EXPECT_THAT(moved.err, HasSubstr("touched or overlapped something at the start and was moved by"));
    EXPECT_THAT(moved.err, testing::Not(HasSubstr("warning")));
}

TEST_F(Told, SpheresThatMayPassBetweenVertices) {
    const std::string small = R"({"sphere": {"centre": [0, 0, 5], "radius": 0.005}})",
                      large = R"({"sphere": {"centre": [0, 0, -5], "radius": 2}})";
    write_scene("sphere.json", {"[0, 0, 0.1]"}, fmt::format(R"("obstacles": [{}, {}])", large, small));
    // The faces of the box are right-angled, with sides of a third of 0.4 m and 0.1 m.
    const std::string gap =
        "the sphere's radius is 0.005 m, but the surface of bodies[0] (b0) has points 0.0687 m from the "
        "nearest vertex of their face; only vertices meet a sphere, so it may pass through faces; a mesh as "
        "obstacle, or a surface of smaller faces, prevents that";
    expect_told("simulate sphere.json -o run.h5", "sphere.json: obstacles[1]: " + gap);
    expect_told("validate sphere.json", "sphere.json: obstacles[1]: " + gap);
    write_scene("spheres.json", {"[0, 0, 0.1]", "[0, 1, 0.1]"},
                fmt::format(R"("obstacles": [{}, {}, {}])", small, large, small));
    expect_told("validate spheres.json", "spheres.json: obstacles[0] and 1 more: " + gap);
    write_scene("large.json", {"[0, 0, 0.1]"}, fmt::format(R"("obstacles": [{}])", large));
    EXPECT_EQ(run("validate large.json --strict").err, "");
}

TEST_F(Told, JumpsThroughABody) {
    write("jump.json", R"({"bodies": [{"body": "box.h5", "transform": {"translate": [0, 0, 0.5]},
        "grips": [{"region": {"box": {"min": [-1, -1, -1], "max": [1, 1, 1]}}, "translate": [0, 0, -1]}]},
        {"body": "box.h5"}], "gravity": [0, 0, 0], "time": {"frames": 2, "steps_per_frame": 1}})");
    const Ran told = simulate("jump.json");
    EXPECT_EQ(told.status, 1);
    EXPECT_THAT(told.err, HasSubstr("nbdtree: error: jump.json: stopped at 0 s: at "));
}

TEST_F(Told, ManyOverlapsInOneLine) {
    write_scene("heap.json", {"[0, 0, 0.1]", "[0.02, 0, 0.1]", "[0.04, 0, 0.1]", "[0.06, 0, 0.1]"});
    const Ran heap = simulate("heap.json");
    EXPECT_THAT(heap.err, HasSubstr("; and 3 more; \"resolve_start\""));
    const std::string told = "at the start";
    const std::size_t first = heap.err.find(told), line = heap.err.find('\n');
    EXPECT_LT(first, line) << heap.err;
    EXPECT_EQ(heap.err.find(told, line), std::string::npos) << heap.err;
}

TEST_F(Told, TetrahedraInsideOut) {
    // Two plates press the box flat in a few steps.
    write("squeeze.json",
          R"({"bodies": [{"body": "box.h5", "name": "box", "transform": {"translate": [0, 0, 0.01]},
        "material": {"young": 1e4, "law": "corotated"}}],
        "obstacles": [{"plane": {}}, {"plane": {"point": [0, 0, 0.12], "normal": [0, 0, -1]}, "velocity": [0, 0, -2],
                       "stop": 0.058}],
        "time": {"dt": 0.002, "frames": 30, "steps_per_frame": 1}})");
    const Ran told = simulate("squeeze.json --csv run.csv --json");
    ASSERT_EQ(told.status, 0) << told.err;
    const auto result = nlohmann::json::parse(told.out);
    const int steps = result["inverted_steps"], most = result["most_inverted"];
    ASSERT_GT(steps, 0) << "no tetrahedron is inside out";
    const std::string line = fmt::format(
        "{} of 30 steps end with tetrahedra inside out, up to {} at once, the first at ", steps, most);
    EXPECT_THAT(told.err, HasSubstr("nbdtree: warning: " + line));
    EXPECT_THAT(std::string(result["warnings"].back()), HasSubstr(line));
    const RecordingReader recording(folder() / "run.h5");
    const std::vector<std::int32_t> marked = recording.facts(0).troubled;
    EXPECT_GE(std::ranges::count(marked, 1), steps);
    const Ran strict = simulate("squeeze.json --strict");
    EXPECT_EQ(strict.status, 1);
    EXPECT_THAT(strict.err, HasSubstr("nbdtree: error: squeeze.json: stopped at "));
}

TEST_F(Told, BodiesThatMoveWrongly) {
    write("bar.obj", test::obj_file(test::box(1, 0.1, 0.1, 1)));
    const std::string thin =
        "is one linear tetrahedron thick in 100 % of its volume, so it bends far too little; quadratic ones "
        "bend rightly: --elements quadratic";
    expect_told("mesh bar.obj -o bar.h5 --elements linear", "bar.h5: " + thin);
    write("bar.json", R"({"bodies": [{"surface": "bar.obj", "name": "bar"},
        {"surface": "bar.obj", "name": "other", "transform": {"translate": [0, 2, 0]}}],
        "time": {"dt": 1e-4, "frames": 1, "steps_per_frame": 1}})");
    expect_told("simulate bar.json -o run.h5", "bar.json: bodies[0] (bar) and 1 more: " + thin);
    expect_told("validate bar.json", "bar.json: bodies[0] (bar) and 1 more: " + thin);
    make("mesh bar.obj -o bar.h5 --elements linear");
    expect_told("dataset bar.h5 -o bar_data.h5 --trajectories 1 --frames 2 --strength 0.01",
                "bar.h5: " + thin);

    write("large.obj", test::obj_file(test::box(100, 40, 40, 4)));
    const std::string large =
        "is 100 m long; if its file is in millimetres, `nbdtree mesh --scale 0.001` makes metres of them";
    expect_told("mesh large.obj -o large.h5", "large.h5: " + large);
    expect_told(
        "mesh box.obj -o rubber.h5 --poisson 0.49 --elements linear",
        "rubber.h5: has a Poisson's ratio of 0.49, at which linear tetrahedra lock: it bends far less than "
        "it should; advised: --elements quadratic, or 0.45 or less");
    write("rubber.json", R"({"bodies": [{"body": "box.h5", "name": "box", "material": {"poisson": 0.48},
        "transform": {"scale": 100}}], "time": {"dt": 1e-4, "frames": 1, "steps_per_frame": 1}})");
    const Ran rubber = simulate("rubber.json");
    EXPECT_THAT(rubber.err, HasSubstr("rubber.json: bodies[0] (box): is 40 m long; "));
    EXPECT_THAT(rubber.err, HasSubstr("rubber.json: bodies[0] (box): has a Poisson's ratio of 0.48, "));
    EXPECT_EQ(simulate("rubber.json --strict").status, 1);
}

}  // namespace
}  // namespace nbd
