// What is wrong with motions and made shapes of a scene, in one line.
#include <gtest/gtest.h>

#include <string>

#include "sim/scene/scene.hpp"
#include "tests/sim/scene/scene_text.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::with;

struct WrongMotion {
    std::string text, message;
};

class WrongMotions : public ::testing::TestWithParam<WrongMotion> {};

TEST_P(WrongMotions, AreRejectedInOneLine) {
    EXPECT_EQ(test::refusal([] { parse_scene(GetParam().text, "folder"); }), GetParam().message);
}

/// A scene with a grip that has these keys, too.
std::string gripped(const std::string& keys) {
    return with(R"("grips": [{"region": {"sphere": {"radius": 1}}, )" + keys + "}]");
}

const WrongMotion wrong_motions[] = {
    {gripped(R"("take": 5, "release": 1)"), "bodies[0].grips[0].release: must not be before \"take\""},
    {gripped(R"("take": -1)"), "bodies[0].grips[0].take: is -1, but must be between 0 and 1e30"},
    {gripped(R"("motion": [])"), "bodies[0].grips[0].motion: must hold at least one keyframe"},
    {gripped(R"("motion": [{}])"), "bodies[0].grips[0].motion[0].time: is missing"},
    {gripped(R"("motion": [{"time": 1}, {"time": 0.5}])"),
     "bodies[0].grips[0].motion[1].time: is 0.5, but must be above 1, the time of the keyframe before"},
    {gripped(R"("motion": [{"time": 1}, {"time": 1}])"),
     "bodies[0].grips[0].motion[1].time: is 1, but must be above 1, the time of the keyframe before"},
    {gripped(R"("motion": [{"time": 1, "interpolation": "cubic"}])"),
     "bodies[0].grips[0].motion[0].interpolation: is \"cubic\", but must be hold, linear or smooth"},
    {gripped(R"("motion": [{"time": 1, "scale": 0}])"),
     "bodies[0].grips[0].motion[0].scale: is 0, but must be between 1e-30 and 1e30"},
    {gripped(R"("motion": [{"time": 1}], "translate": [0, 0, 1])"),
     "bodies[0].grips[0].translate: must not be beside \"motion\", whose keyframes say it"},
    {with("", R"("obstacles": [{"plane": {}, "motion": [{"time": 1}], "velocity": [0, 0, 1]}])"),
     "obstacles[0].velocity: must not be beside \"motion\", whose keyframes say it"},
    {with("", R"("obstacles": [{"box": {}}])"), "obstacles[0].box.size: is missing"},
    {with("", R"("obstacles": [{"box": {"size": [1, 0, 1]}}])"),
     "obstacles[0].box.size: must be three positive lengths"},
    {with("", R"("obstacles": [{"cylinder": {"radius": 1}}])"), "obstacles[0].cylinder.length: is missing"},
    {with("", R"("obstacles": [{"capsule": {"radius": 1, "length": 1, "segments": 2}}])"),
     "obstacles[0].capsule.segments: is 2, but must be between 3 and 1024"},
    {with("", R"("obstacles": [{"heights": {"spacing": 1, "table": [[0, 1]]}}])"),
     "obstacles[0].heights.table: has 1 rows of 2 heights, but must have at least 2 of 2"},
    {with("", R"("obstacles": [{"heights": {"spacing": 1, "table": [[0, 1], [0]]}}])"),
     "obstacles[0].heights.table: row 1 has 1 heights, but row 0 has 2"},
    {with("", R"("obstacles": [{"heights": {"spacing": 1, "table": [[0, 1], 3]}}])"),
     "obstacles[0].heights.table: row 1 must be finite numbers, not 3"},
};

INSTANTIATE_TEST_SUITE_P(All, WrongMotions, ::testing::ValuesIn(wrong_motions));

}  // namespace
}  // namespace nbd
