// Scenes with one thing wrong each: joints, tendons, muscles, loads, regions, rigid bodies, balance,
// variables.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/apps/command.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd::test {
namespace {

/// A block with muscles hangs over a floor; a rigid crate turns on a ball, and a motor turns an arm on it
/// that a tendon pulls.
const char* right_scene = R"({
    "bodies": [
        {"tets": "BLOCK", "name": "soft", "meshing": {"scale": 0.1}, "transform": {"translate": [0, 0, 0.2]},
         "pins": [{"box": {"min": [-1, -1, 0.24], "max": [1, 1, 1]}}], "loads": [{"force": [0, 0, -1]}],
         "muscles": [{"region": {"group": "group 1"}, "direction": [0, 0, 1], "stress": 1000}],
         "regions": [{"group": "group 2", "material": {"young": 2e5}}]},
        {"tets": "BLOCK", "name": "crate", "meshing": {"elements": "rigid", "scale": 0.1},
         "material": {"density": 500}, "transform": {"translate": [0.3, 0, 0.2]}},
        {"tets": "BLOCK", "name": "arm", "meshing": {"elements": "rigid", "scale": 0.1},
         "material": {"density": 500}, "transform": {"translate": [0.6, 0, 0.2]}}
    ],
    "joints": [
        {"name": "elbow", "bodies": ["crate", "arm"],
         "hinge": {"point": [0.45, 0, 0.2], "axis": [0, 1, 0], "motor": [[0, 0], [1, 30]]}},
        {"name": "post", "body": "crate", "ball": {"point": [0.3, 0, 0.3]}}
    ],
    "tendons": [{"name": "cord", "force": 2, "through": [{"body": "arm", "at": [0.6, 0, 0.2]}, {"at": [0.6, 0, 1]}]}],
    "obstacles": [{"name": "floor", "plane": {}}],
    "time": {"dt": 0.005, "frames": 2}
})";

/// An edit of the scene: a JSON pointer, the value that takes its place, or "" where the key is left out, and
/// the line that names the problem.
struct Edit {
    std::string at, value, problem;
};

std::string crate_of_inertia(const std::string& inertia) {
    return R"({"tets": ")" NBD_ASSETS
           R"(/block.mesh", "name": "arm", "meshing": {"elements": "rigid", "scale": 0.1},
              "transform": {"translate": [0.6, 0, 0.2]}, "inertia": )" +
           inertia + "}";
}

const Edit edits[] = {
    {"/joints/0/hinge/axis", "[0, 0, 0]", "joints[0].hinge.axis: must not be zero"},
    {"/joints/0/hinge/motor", "[[1, 0], [0, 30]]",
     "joints[0].hinge.motor: its times must increase, but 0 s follows 1 s"},
    {"/joints/0/hinge/least", "-10",
     R"(joints[0]: joint "elbow": a hinge needs both limits or none, as angles come round again)"},
    {"/joints/0/hinge", R"({"point": [0.45, 0, 0.2], "least": 10, "most": -10})",
     R"(joints[0]: joint "elbow": its least value must be below its most)"},
    {"/joints/0/hinge", R"({"point": [0.45, 0, 0.2], "least": -170, "most": 10})",
     "joints[0].hinge.least: is -170, but must be between -150 and 150"},
    {"/joints/0/hinge", R"({"axis": [0, 0, 1]})", "joints[0].hinge.point: is missing"},
    {"/bodies/1/inertia", R"({"mass": 1})",
     R"(bodies[1].material.density: must not be beside "inertia", which gives the mass)"},
    {"/bodies/0/inertia", R"({"mass": 1})",
     R"(bodies[0]: inertia: only a rigid body is told its own; set "density" in "material")"},
    {"/bodies/2", crate_of_inertia(R"({"mass": 1, "moments": [1, 1, 3]})"),
     "bodies[2]: inertia: principal moments 1, 1 and 3 kg m2; allowed: more than 0, none larger than the two "
     "others together"},
    {"/bodies/2", crate_of_inertia(R"({"mass": 1, "moments": [1, 1, 1]})"),
     "bodies[2]: inertia: a centre of mass and moments that reach out of the tetrahedron of the rigid body, three "
     "times as large as its surface; allowed: those of masses about where the surface is"},
    {"/bodies/2", crate_of_inertia(R"({"mass": 0})"),
     "bodies[2].inertia.mass: is 0, but must be between 1e-30 and 1e30"},
    {"/bodies/2", crate_of_inertia(R"({"moments": [1, 1, 1]})"), "bodies[2].inertia.mass: is missing"},
    {"/bodies/2", crate_of_inertia(R"({"mass": 1, "products": [1, 1, 1]})"),
     "bodies[2].inertia.moments: is missing"},
    {"/joints/0/strength", "-1", "joints[0].strength: is -1, but must be between 1e-30 and 1e30"},
    {"/joints/0/bodies", R"(["crate", "crate"])", "joints[0].bodies: joins a body to itself"},
    {"/joints/0/bodies", R"(["crate", "leg"])",
     R"(joints[0].bodies: no body is named "leg"; allowed: soft, crate, arm)"},
    {"/joints/0/body", R"("crate")", R"(joints[0]: needs exactly one of "bodies" and "body")"},
    {"/joints/0/ball", R"({"point": [0, 0, 0]})",
     R"(joints[0]: needs exactly one of "ball", "hinge", "slider", "weld", "spring" and "rope")"},
    {"/joints/0/hinge", "",
     R"(joints[0]: needs exactly one of "ball", "hinge", "slider", "weld", "spring" and "rope")"},
    {"/joints/0/hinge/stiffness", "-1", "joints[0].hinge.stiffness: is -1, but must be between 0 and 1e30"},
    {"/joints/0/hinge/stiffness", "5",
     R"(joints[0]: joint "elbow": a motor leaves nothing to limits, a spring or a damper; name one of them)"},
    {"/joints/0/meet", "1", "joints[0].meet: must be true or false, not 1"},
    {"/joints/0", R"({"body": "soft", "weld": {"region": {"box": {"min": [5, 5, 5], "max": [6, 6, 6]}}}})",
     "joints[0].weld.region: holds 0 of the nodes of the first body; allowed: 3 or more"},
    {"/joints/0", R"({"bodies": ["soft", "crate"], "weld": {}})", "joints[0].weld.region: is missing"},
    {"/joints/0", R"({"bodies": ["soft", "crate"], "weld": {"region": {"group": "nose"}}})",
     R"(joints[0].weld.region: the body has no group "nose"; allowed: group 1, group 2)"},
    {"/joints/0", R"({"body": "crate", "rope": {"from": [0, 0, 0], "to": [0, 0, 0]}})",
     R"(joints[0]: joint "joints[0]": its length is 0 m, but must be > 0)"},
    {"/joints/0", R"({"body": "crate", "spring": {"from": [0.3, 0, 0.2], "to": [0.3, 0, 1]}})",
     "joints[0].spring.stiffness: is missing"},
    {"/joints/0",
     R"({"body": "crate", "spring": {"from": [0.3, 0, 0.2], "to": [0.3, 0, 1], "stiffness": 0}})",
     "joints[0].spring.stiffness: is 0, but must be between 1e-30 and 1e30"},
    {"/joints/0", R"({"body": "crate", "slider": {"point": [0.3, 0, 0.2], "least": 1}})",
     R"(joints[0]: joint "joints[0]": it starts at 0, which its limits must allow)"},
    {"/joints/0",
     R"({"body": "crate", "slider": {"point": [0.3, 0, 0.2], "motor": [[0, 0]], "least": -1, "most": 1}})",
     R"(joints[0]: joint "joints[0]": a motor leaves nothing to limits, a spring or a damper; name one of them)"},
    {"/joints/1/name", R"("elbow")", R"(joints[1].name: "elbow" is the name of another joint)"},
    {"/joints", R"({"a": 1})", R"(joints: must be an array, not {"a":1})"},
    {"/tendons/0/through", R"([{"at": [0, 0, 1]}])", "tendons[0].through: must be two points or more"},
    {"/tendons/0/through", R"([{"at": [0, 0, 1]}, {"at": [0, 0, 2]}])",
     "tendons[0].through: must have a point of a body"},
    {"/tendons/0/force", "-2", "tendons[0].force: is -2, but must be between 0 and 1e30"},
    {"/tendons/0/force", "", "tendons[0]: needs exactly one of \"force\" and \"winch\""},
    {"/tendons/0/through/0/body", R"("leg")",
     R"(tendons[0].through[0].body: no body is named "leg"; allowed: soft, crate, arm)"},
    {"/tendons/0/factor", "[[0, -1]]", "tendons[0].factor: must not be below 0: a tendon only pulls"},
    {"/tendons/0/factor", "[[1, 0], [0.5, 1]]",
     "tendons[0].factor: its times must increase, but 0.5 s follows 1 s"},
    {"/tendons/0/through/1", R"({"body": "arm", "at": [0.6, 0, 0.2]})",
     "tendons[0].through[1].at: is where the point before it is"},
    {"/tendons/0/tension", "5", R"(tendons[0]: unknown key "tension")"},
    {"/bodies/0/muscles/0/stress", "0",
     "bodies[0].muscles[0].stress: is 0, but must be between 1e-30 and 1e30"},
    {"/bodies/0/muscles/0/stress", "-5",
     "bodies[0].muscles[0].stress: is -5, but must be between 1e-30 and 1e30"},
    {"/bodies/0/muscles/0/direction", "[0, 0, 0]", "bodies[0].muscles[0].direction: must not be zero"},
    {"/bodies/0/muscles/0/along", "[[0, 0, 0], [0, 0, 1]]",
     R"(bodies[0].muscles[0]: needs exactly one of "direction" and "along")"},
    {"/bodies/0/muscles/0", R"({"stress": 5, "along": [[0, 0, 0]]})",
     "bodies[0].muscles[0].along: must be two points or more, each of three numbers, each apart from the next"},
    {"/bodies/0/muscles/0", R"({"stress": 5})",
     R"(bodies[0].muscles[0]: needs exactly one of "direction" and "along")"},
    {"/bodies/0/muscles/0/region", R"({"group": "biceps"})",
     R"(bodies[0]: muscles[0]: the body has no group "biceps"; allowed: group 1, group 2)"},
    {"/bodies/0/muscles/0/factor", "[[0, -1]]",
     "bodies[0].muscles[0].factor: must not be below 0: a muscle only pulls"},
    {"/bodies/0/muscles/0/region", R"({"sphere": {"centre": [9, 9, 9], "radius": 1}})",
     "bodies[0]: muscles[0]: the region holds no centre of a tetrahedron of the body"},
    {"/bodies/1/muscles", R"([{"stress": 5, "direction": [0, 0, 1]}])",
     "bodies[1]: muscles[0]: a rigid body has no muscles; use a joint with a motor, or a tendon"},
    {"/bodies/0/muscles/0/region", R"({"nodes": [0]})",
     "bodies[0]: muscles[0]: the region holds no centre of a tetrahedron of the body"},
    {"/bodies/1/material/young", "100000.0",
     R"(bodies[1]: material: of a rigid body only "density" can be set)"},
    {"/bodies/1/regions", R"([{"group": "group 1", "material": {"young": 100000.0}}])",
     "bodies[1]: regions: a rigid body has none"},
    {"/bodies/1/tree", R"("a.h5")", "bodies[1]: a.h5: no such file"},
    {"/bodies/1/meshing/elements", R"("stiff")",
     R"(bodies[1].meshing.elements: is "stiff", but must be linear, quadratic or rigid)"},
    {"/bodies/1/margin", "0.1", "bodies[1]: margin is 0.1, but exact boxes take none"},
    {"/bodies/1/loads",
     R"([{"torque": [0, 0, 1], "region": {"box": {"min": [-1, -1, -1], "max": [1, 1, 1]}}}])",
     "bodies[1]: loads[0]: of a rigid body a torque or an acceleration acts on the whole; leave its region out"},
    {"/bodies/1/loads", R"([{"force": [0, 0, 1], "region": {"box": {"min": [5, 5, 5], "max": [6, 6, 6]}}}])",
     "bodies[1]: loads[0]: the region holds no face of the rigid body's surface"},
    {"/bodies/0/loads/0/region", R"({"box": {"min": [-1, -1, 0.24], "max": [1, 1, 1]}})",
     "bodies[0]: loads[0]: pins or grips hold all that it acts on, so it moves nothing; widen its region"},
    {"/bodies/0/loads/0/region", R"({"box": {"min": [1, 1, 1], "max": [0, 0, 0]}})",
     R"(bodies[0].loads[0].region.box.max: must not be below "min")"},
    {"/bodies/0/loads/0/region", R"({"group": "inlet"})",
     R"(bodies[0]: loads[0]: the body has no group "inlet"; allowed: group 1, group 2)"},
    {"/bodies/0/loads/0/region", R"({"nodes": [100000]})",
     "bodies[0]: loads[0]: the body has no node 100000; allowed: 0 to 215"},
    {"/bodies/0/loads/0/region", R"({"faces": [9999]})",
     "bodies[0]: loads[0]: the body has no face 9999; allowed: 0 to 299"},
    {"/bodies/0/loads/0/region", R"({"all": []})",
     "bodies[0].loads[0].region.all: must be a list of regions, not empty"},
    {"/bodies/0/loads/0/region", R"({"near": {"body": "leg", "distance": 0.1}})",
     R"(bodies[0].loads[0].region.near.body: no body is named "leg"; allowed: soft, crate, arm)"},
    {"/bodies/0/loads/0/region", R"({"near": {"body": "crate"}})",
     "bodies[0].loads[0].region.near.distance: is missing"},
    {"/bodies/0/loads/0/region", R"({"near": {"obstacle": "floor", "distance": 0.001}})",
     "bodies[0]: loads[0]: the region holds no node of the body"},
    {"/bodies/0/loads/0/region", R"({"near": {"body": "crate", "obstacle": "floor", "distance": 1}})",
     R"(bodies[0].loads[0].region.near: needs exactly one of "body" and "obstacle")"},
    {"/bodies/0/loads/0/region", R"({"capsule": {"from": [0, 0, 0], "to": [0, 0, 1]}})",
     "bodies[0].loads[0].region.capsule.radius: is missing"},
    {"/bodies/0/loads/0/region", R"({"not": {"box": {"min": [-9, -9, -9], "max": [9, 9, 9]}}})",
     "bodies[0]: loads[0]: the region holds no node of the body"},
    {"/bodies/0/loads/0/region", R"({"sphere": {"radius": 1}, "box": {"min": [0, 0, 0], "max": [1, 1, 1]}})",
     R"(bodies[0].loads[0].region: needs exactly one of "box", "sphere", "capsule", "near", "group", "nodes", "faces", "all", "any" and "not")"},
    {"/bodies/0/loads/0/region", "{}",
     R"(bodies[0].loads[0].region: needs exactly one of "box", "sphere", "capsule", "near", "group", "nodes", "faces", "all", "any" and "not")"},
    {"/bodies/0/loads/0/force", "[0, 0]", "bodies[0].loads[0].force: must be three numbers, not [0,0]"},
    {"/bodies/0/loads/0", R"({"gas": {}, "cavity": 0})",
     "bodies[0]: loads[0].cavity: is 0, but the body has no cavity: no part of its surface lies closed within another"},
    {"/bodies/0/loads/0", R"({"pressure": 5, "cavity": 0})",
     "bodies[0]: loads[0].cavity: is 0, but the body has no cavity: no part of its surface lies closed within another"},
    {"/bodies/0/regions/0/group", R"("core")",
     R"(bodies[0]: regions[0]: the body has no group "core"; allowed: group 1, group 2)"},
    {"/bodies/0/regions/0/material", R"({"law": "rubber"})",
     R"(bodies[0].regions[0].material.law: is "rubber", but must be corotated, stable_neo_hookean or st_venant_kirchhoff)"},
    {"/bodies/0/regions/0/region", R"({"group": "group 1"})",
     R"(bodies[0].regions[0]: needs exactly one of "group" and "region")"},
    {"/bodies/0/regions/0/material", R"({"rayleigh_mass": 1})",
     R"(bodies[0].regions[0].material: unknown key "rayleigh_mass")"},
    {"/time", R"({"static": {"increments": 0}})",
     "time.static.increments: is 0, but must be between 1 and 10000"},
    {"/time", R"({"static": {"tolerance": 0}})",
     "time.static.tolerance: is 0, but must be between 1e-10 and 0.1"},
    {"/time", R"({"static": {}, "dt": 0.1})",
     R"(time.dt: must not be beside "static", whose increments are the frames)"},
    {"/time", R"({"static": 5})", "time.static: must be an object, not 5"},
    {"/time", R"({"static": {"steps": 5}})", R"(time.static: unknown key "steps")"},
    {"/variables", R"([{"name": "a", "uniform": [1, 0]}])",
     "variables[0].uniform: is [1,0]; the first must not be above the second"},
    {"/variables", R"([{"name": "a b", "uniform": [0, 1]}])",
     "variables[0].name: must be of letters, digits and underscores"},
    {"/variables", R"([{"name": "a"}])",
     R"(variables[0]: needs exactly one of "uniform", "log_uniform", "integer", "choice", "direction" and "rotation")"},
    {"/variables", R"([{"name": "a", "uniform": [0, 1], "integer": [0, 1]}])",
     R"(variables[0]: needs exactly one of "uniform", "log_uniform", "integer", "choice", "direction" and "rotation")"},
    {"/variables", R"([{"name": "a", "log_uniform": [0, 1]}])",
     "variables[0].log_uniform: is [0,1], but a logarithm needs numbers above 0"},
    {"/variables", R"([{"name": "a", "choice": []}])",
     "variables[0].choice: must be a list of numbers or of texts, not []"},
    {"/variables", R"([{"name": "a", "uniform": [0, 1]}, {"name": "a", "uniform": [0, 1]}])",
     R"(variables[1].name: "a" is the name of another variable)"},
    {"/variables", R"([{"name": "a", "direction": [0, 0, 0]}])", "variables[0].direction: must not be zero"},
    {"/variables", "[]", "variables: must hold at least one variable"},
    {"/variables", R"([{"name": "a", "integer": [0.5, 1]}])",
     "variables[0].integer: must be [low, high], two whole numbers within 1e12, not [0.5,1]"},
    {"/bodies/0/loads/0/force", R"({"var": "push"})",
     R"(bodies[0].loads[0].force: must be three numbers, not {"var":"push"})"},
    {"/units", R"("mm")", R"(unknown key "units")"},
    {"/bodies/0/material", R"({"E": 100000.0})",
     R"(bodies[0].material: unknown key "E"; the nearest known one is "young")"},
    {"/bodies/0/material", R"({"nu": 0.3})",
     R"(bodies[0].material: unknown key "nu"; the nearest known one is "poisson")"},
    {"/bodies/0/material", R"({"rho": 1000.0})",
     R"(bodies[0].material: unknown key "rho"; the nearest known one is "density")"},
    {"/contact", R"({"pairs": [{"bodies": ["soft", "leg"], "meet": false}]})",
     R"(contact.pairs[0].bodies: no body is named "leg"; allowed: soft, crate, arm)"},
    {"/bodies/0/pins/0", R"({"group": "group 9"})",
     R"(bodies[0].pins[0]: the body has no group "group 9"; allowed: group 1, group 2)"},
    {"/bodies/1/pins", R"([{"group": "group 1"}])",
     R"(bodies[1].pins[0]: the body has no group "group 1"; allowed: none, it has no groups)"},
    {"/obstacles/0/plane/normal", "[0, 0, 0]", "obstacles[0].plane.normal: must not be zero"},
};

nlohmann::json right() {
    nlohmann::json scene = nlohmann::json::parse(right_scene);
    for (nlohmann::json& body : scene["bodies"]) body["tets"] = NBD_ASSETS "/block.mesh";
    return scene;
}

nlohmann::json edited(const Edit& edit) {
    nlohmann::json scene = right();
    const nlohmann::json::json_pointer at(edit.at);
    if (edit.value.empty())
        scene[at.parent_pointer()].erase(at.back());
    else
        scene[at] = nlohmann::json::parse(edit.value);
    return scene;
}

TEST(WrongScenes, AreToldInOneLineEach) {
    const TemporaryFolder folder;
    folder.write("right.json", right().dump());
    std::string files = "right.json", expected = "right.json: valid\n";
    for (std::size_t i = 0; i < std::size(edits); ++i) {
        const std::string name = fmt::format("{}.json", i);
        folder.write(name, edited(edits[i]).dump());
        files += " " + name;
        expected += name + ": " + edits[i].problem + "\n";
    }
    const Ran ran = run(folder / "", "validate " + files);
    EXPECT_EQ(ran.status, 1);
    const std::vector<std::string> told = lines(ran.out), wanted = lines(expected);
    ASSERT_EQ(told.size(), wanted.size()) << ran.out;
    for (std::size_t i = 0; i < wanted.size(); ++i) EXPECT_EQ(told[i], wanted[i]);
}

TEST(WrongScenes, AreToldWhereOnlyARunCanKnow) {
    const TemporaryFolder folder;
    const auto told = [&](const nlohmann::json& scene) {
        folder.write("scene.json", scene.dump());
        return run(folder / "", "simulate scene.json -o run.h5 --quiet");
    };
    const Ran pulled = told(edited({"/joints/0",
                                    R"({"name": "rail", "body": "crate", "slider": {"point": [0.3, 0, 0.2],
                         "axis": [1, 0, 0], "motor": [[0, 0], [0.01, 0.1]]}})",
                                    ""}));
    EXPECT_EQ(pulled.status, 0) << pulled.err;
    EXPECT_NE(pulled.err.find("joint \"rail\" gives by"), std::string::npos) << pulled.err;
    EXPECT_NE(pulled.err.find("contradicts another joint or a grip"), std::string::npos) << pulled.err;
    // The cord bears a fifth of the crate and its arm, and nothing the rest.
    nlohmann::json falling = edited({"/time", R"({"static": {}})", ""});
    falling.erase("obstacles");
    falling["joints"].erase(1);
    const Ran free = told(falling);
    EXPECT_EQ(free.status, 1);
    EXPECT_NE(free.err.find("nothing holds bodies[1] (crate)"), std::string::npos) << free.err;
}

}  // namespace
}  // namespace nbd::test
