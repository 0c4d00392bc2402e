// Regions, and what stands in them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "meshing/body/make_body.hpp"
#include "meshing/body/rigid_body.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/scene/read_parts.hpp"
#include "sim/scene/scene.hpp"
#include "sim/scene/scene_check.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/sim/scene/scene_text.hpp"
#include "tests/sim/support/momentum.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using Eigen::Vector3d;
using test::complaint;
using test::with;

/// A bar whose end at low x is a group of faces, and a half a group of tetrahedra.
Body bar_with_groups(bool is_quadratic) {
    const Vector3d size(1, 0.4, 0.3);
    TetMesh mesh = test::box_mesh(size, {4, 2, 2});
    mesh.X.rowwise() -= 0.5 * size.transpose();
    if (is_quadratic) mesh = make_quadratic(mesh);
    Body body = make_body("bar", std::move(mesh), {.rayleigh_mass = 0});
    FaceGroup end{.name = "end", .faces = {}};
    for (int f = 0; f < body.surface.F.rows(); ++f)
        if (std::ranges::all_of(std::array{0, 1, 2},
                                [&](int k) { return body.surface.X(body.surface.F(f, k), 0) < -0.49; }))
            end.faces.push_back(f);
    MaterialRegion half{.name = "half", .material = body.material, .tets = {}};
    for (int t = 0; t < body.tets.T.rows(); ++t)
        if (test::centre(body.tets, t)[0] > 0) half.tets.push_back(t);
    half.material.young = 5e5;
    body.face_groups = {end};
    body.regions = {half};
    return body;
}

Region region_of(const std::string& text) {
    const nlohmann::json json = nlohmann::json::parse(text);
    return read_region(JsonObject(json, "region"));
}

/// The rows that a region should select by the positions of what they are of.
std::vector<int> rows_where(const Nodes& x, const std::function<bool(const Vector3d&)>& is_in) {
    std::vector<int> rows;
    for (int i = 0; i < x.rows(); ++i)
        if (is_in(x.row(i).transpose())) rows.push_back(i);
    return rows;
}

class Regions : public ::testing::TestWithParam<bool> {
 protected:
    const Body body = bar_with_groups(GetParam());
    const Nodes& x = body.tets.X;
    std::vector<int> parts(const std::string& region, BodyPart part = BodyPart::node) const {
        return parts_in("here", region_of(region), part, {body, x});
    }
};

TEST_P(Regions, SelectNodesBySpace) {
    const Vector3d from(-0.3, 0, 0), to(0.4, 0.1, 0.05);
    EXPECT_EQ(parts(R"({"capsule": {"from": [-0.3, 0, 0], "to": [0.4, 0.1, 0.05], "radius": 0.16}})"),
              rows_where(x, [&](const Vector3d& p) {
                  double least = 1;  // by samples of the line
                  for (int k = 0; k <= 4000; ++k)
                      least = std::min(least, (p - from - k / 4000.0 * (to - from)).norm());
                  return least <= 0.16;
              }));
    const std::string box = R"({"box": {"min": [-1, -1, -1], "max": [0.1, 1, 1]}})",
                      ball = R"({"sphere": {"centre": [0, 0, 0], "radius": 0.3}})";
    const auto in_box = [](const Vector3d& p) { return p.x() <= 0.1; };
    const auto in_ball = [](const Vector3d& p) { return p.norm() <= 0.3; };
    EXPECT_EQ(parts(R"({"all": [)" + box + R"(, {"not": )" + ball + "}]}"),
              rows_where(x, [&](const Vector3d& p) { return in_box(p) && !in_ball(p); }));
    EXPECT_EQ(parts(R"({"any": [)" + box + ", " + ball + "]}"),
              rows_where(x, [&](const Vector3d& p) { return in_box(p) || in_ball(p); }));
    EXPECT_EQ(parts(R"({"not": )" + ball + "}"),
              rows_where(x, [&](const Vector3d& p) { return !in_ball(p); }));
    ASSERT_FALSE(parts(ball).empty());
}

TEST_P(Regions, SelectNodesFacesAndTetrahedraByGroup) {
    const std::string end = R"({"group": "end"})", half = R"({"group": "half"})";
    EXPECT_EQ(parts(end), rows_where(x, [](const Vector3d& p) { return p.x() < -0.499; }));
    EXPECT_EQ(parts(end, BodyPart::face), body.face_groups[0].faces);
    EXPECT_EQ(parts(end, BodyPart::vertex),
              rows_where(body.surface.X, [](const Vector3d& p) { return p.x() < -0.499; }));
    EXPECT_EQ(parts(half, BodyPart::tet), body.regions[0].tets);
    EXPECT_EQ(parts(half), rows_where(x, [](const Vector3d& p) { return p.x() > -1e-9; }));
    EXPECT_EQ(parts(half, BodyPart::vertex),
              rows_where(body.surface.X, [](const Vector3d& p) { return p.x() > -1e-9; }));
    EXPECT_EQ(parts(R"({"all": [{"group": "end"}, {"box": {"min": [-1, -1, -0.001], "max": [1, 1, 1]}}]})",
                    BodyPart::face)
                  .size(),
              body.face_groups[0].faces.size() / 2);
    const auto error = [&](const std::string& region, BodyPart part) {
        return test::error_of<std::invalid_argument>([&] { parts(region, part); });
    };
    EXPECT_EQ(error(R"({"group": "ends"})", BodyPart::node),
              R"(here: the body has no group "ends"; allowed: half, end)");
    EXPECT_EQ(error(end, BodyPart::tet),
              "here: these are faces; allowed: a part of space, or a group of tetrahedra");
}

TEST_P(Regions, SelectByNumber) {
    EXPECT_EQ(parts(R"({"nodes": [7, 3, 7]})"), (std::vector<int>{3, 7}));
    EXPECT_EQ(parts(R"({"faces": [5, 2]})", BodyPart::face), (std::vector<int>{2, 5}));
    const auto corners = body.surface.F.row(5);
    std::vector<int> vertices(corners.begin(), corners.end());
    std::ranges::sort(vertices);
    EXPECT_EQ(parts(R"({"faces": [5]})", BodyPart::vertex), vertices);
    EXPECT_EQ(parts(R"({"faces": [5]})").size(), GetParam() ? 6u : 3u);  // with the middles of its edges
    std::string four;
    for (const int node : body.tets.T.row(9)) four += (four.empty() ? "" : ", ") + std::to_string(node);
    EXPECT_EQ(parts(R"({"nodes": [)" + four + "]}", BodyPart::tet), std::vector<int>{9});
    const auto error = [&](const std::string& region) {
        return test::error_of<std::invalid_argument>([&] { parts(region); });
    };
    EXPECT_EQ(error(R"({"nodes": [3, 9999]})"),
              fmt::format("here: the body has no node 9999; allowed: 0 to {}", x.rows() - 1));
    EXPECT_EQ(error(R"({"faces": [9999]})"),
              fmt::format("here: the body has no face 9999; allowed: 0 to {}", body.surface.F.rows() - 1));
}

INSTANTIATE_TEST_SUITE_P(OfElements, Regions, ::testing::Values(false, true));

TEST(Scene, RefusesRegionsThatAreWrong) {
    const auto pin = [](const std::string& region) {
        return complaint(with(R"("pins": [)" + region + "]",
                              R"("obstacles": [{"name": "floor", "plane": {"point": [0, 0, -5]}}])"));
    };
    const std::string at = "bodies[0].pins[0]";
    EXPECT_EQ(pin(R"({"near": {"obstacle": "floor", "distance": 1}})"), "");
    EXPECT_EQ(pin(R"({"near": {"body": "b", "distance": 1}})"),
              at + R"(.near.body: no body is named "b"; allowed: a; the nearest is "a")");
    EXPECT_EQ(
        pin(R"({"any": [{"near": {"obstacle": "flor", "distance": 1}}]})"),
        at + R"(.any[0].near.obstacle: no obstacle is named "flor"; allowed: floor; the nearest is "floor")");
    EXPECT_EQ(pin(R"({"near": {"body": "a"}})"), at + ".near.distance: is missing");
    EXPECT_EQ(pin(R"({"near": {"body": "a", "distance": 0}})"),
              at + ".near.distance: is 0, but must be between 1e-30 and 1e30");
    EXPECT_EQ(pin(R"({"nodes": []})"), at + ".nodes: must be a list of whole numbers from 0 on, not empty");
    EXPECT_EQ(pin(R"({"faces": [1, -2]})"),
              at + ".faces: must be a list of whole numbers from 0 on, not empty");
    EXPECT_EQ(pin(R"({"nodes": [1.5]})"),
              at + ".nodes: must be a list of whole numbers from 0 on, not empty");
    EXPECT_EQ(pin(R"({"any": []})"), at + ".any: must be a list of regions, not empty");
    EXPECT_EQ(pin(R"({"group": ""})"), at + ".group: must be the name of a group");
    EXPECT_EQ(pin(R"({"capsule": {"from": [0, 0, 0], "radius": 1}})"), at + ".capsule.to: is missing");
    EXPECT_EQ(pin(R"({"capsule": {"from": [0, 0, 0], "to": [0, 0, 1]}})"),
              at + ".capsule.radius: is missing");
    EXPECT_EQ(pin(R"({"group": "a", "nodes": [1]})").substr(0, at.size() + 27),
              at + ": needs exactly one of \"box");
}

TEST(CheckScene, NamesWhatIsNotThereToBeNearTo) {
    const LoadedBody bodies[] = {
        {std::make_shared<const Body>(test::box_body({1, 0.4, 0.3}, {4, 2, 2})), nullptr}, {}};
    const auto problems = [&](const std::string& near) {
        const SceneReading reading = read_scene(R"({"bodies": [{"body": "a", "pins": [{"near": {"body": ")" +
                                                    near + R"(", "distance": 1}}]}, {"body": "missing"}]})",
                                                "");
        EXPECT_EQ(reading.body_is_good[0], reading.problems.empty());
        return reading.problems.empty() ? check_scene(reading, bodies).problems : reading.problems;
    };
    EXPECT_EQ(problems("a"), std::vector<std::string>{});
    EXPECT_EQ(
        problems("b"),
        std::vector<std::string>{
            R"(bodies[0].pins[0].near.body: no body is named "b"; allowed: a, missing; the nearest is "a")"});
    EXPECT_EQ(problems("missing"),
              std::vector<std::string>{
                  R"(bodies[0].pins[0]: the body "missing" that it is near to could not be loaded)"});
}

/// Near a body and near an obstacle, also where positions are counted from an origin.
TEST(BuildWorld, FindsRegionsNearBodiesAndObstacles) {
    const LoadedBody bar{std::make_shared<const Body>(test::box_body({1, 0.4, 0.3}, {10, 2, 2})), nullptr};
    for (const double far : {0.0, 1e7}) {
        const std::string scene = fmt::format(
            R"({{"bodies": [{{"body": "a", "transform": {{"translate": [{}, 0, 0]}},
                    "pins": [{{"near": {{"body": "b", "distance": 0.25}}}}],
                    "grips": [{{"region": {{"near": {{"obstacle": "ball", "distance": 0.16}}}}}}]}},
                   {{"body": "b", "transform": {{"translate": [{}, 0, 0]}}}}],
                "obstacles": [{{"name": "ball", "sphere": {{"centre": [{}, 0, 0], "radius": 0.1}}}}]}})",
            far, far + 1.1, far - 0.65);
        const LoadedBody both[] = {bar, bar};
        World moving = build_world(parse_scene(scene, ""), both);
        const Nodes& X = bar.body->tets.X;  // the gap is 0.1 wide
        std::set<int> held;
        std::vector<int> expected = rows_where(X, [](const Vector3d& p) { return p.x() > 0.34; });
        const std::vector<int> by_ball =
            rows_where(X, [](const Vector3d& p) { return (p - Vector3d(-0.65, 0, 0)).norm() <= 0.26; });
        ASSERT_FALSE(by_ball.empty());
        moving.step(5e-3);
        for (const Reaction& reaction : moving.reactions())
            if (reaction.by == ReactionBy::grip) held.insert(reaction.number);
        EXPECT_EQ(held, (std::set<int>{0, 1}));
        for (int i = 0; i < X.rows(); ++i) {
            const bool is_held =
                std::ranges::binary_search(expected, i) || std::ranges::binary_search(by_ball, i);
            EXPECT_EQ(moving.state(0).v.row(i).isZero(0), is_held) << i;
        }
    }
}

/// A force on a part of a rigid body pushes and turns it as one at the part's centre does.
TEST(BuildWorld, PutsForcesOnTheSurfaceOfRigidBodies) {
    TriMesh box = test::box(0.4, 0.2, 0.1, 4);
    box.X.rowwise() -= Eigen::RowVector3d(0.2, 0.1, 0.05);
    const LoadedBody rigid{std::make_shared<const Body>(make_rigid_body("box", std::move(box), 1000)),
                           nullptr};
    const auto scene = [](const std::string& load) {
        return with(
            R"("loads": [{"region": {"box": {"min": [0.19, -1, -1], "max": [1, 1, 1]}}, )" + load + "}]",
            R"("gravity": [0, 0, 0])");
    };
    World world = build_world(parse_scene(scene(R"("force": [0, 0, 3])"), ""), std::span(&rigid, 1));
    constexpr double time = 2e-3;
    world.step(time);
    EXPECT_LT((test::linear_momentum(world, 0) - time * Vector3d(0, 0, 3)).norm(), 1e-9);
    EXPECT_LT((momentum_of(world.elastic(0), world.state(0)).angular -
               time * Vector3d(0.2, 0, 0).cross(Vector3d(0, 0, 3)))
                  .norm(),
              1e-5 * time);
    EXPECT_EQ(
        test::error_of<std::invalid_argument>(
            [&] { build_world(parse_scene(scene(R"("torque": [0, 0, 3])"), ""), std::span(&rigid, 1)); }),
        "bodies[0] (a): loads[0]: of a rigid body a torque or an acceleration acts on the whole; leave its "
        "region out");
}

TEST(BuildWorld, TurnsFibresOfMusclesWithTheirBody) {
    const LoadedBody bar{std::make_shared<const Body>(bar_with_groups(false)), nullptr};
    const auto length_along_bar = [&](const std::string& fibres) {
        World world = build_world(
            parse_scene(
                with(R"("transform": {"rotate": {"axis": [0, 0, 1], "degrees": 90}, "translate": [0, 3, 0]},
                               "muscles": [{"stress": 2000, )" +
                         fibres + "}]",
                     R"("gravity": [0, 0, 0], "solver": {"integrator": "backward_euler"})"),
                ""),
            std::span(&bar, 1));
        for (int step = 0; step < 20; ++step) world.step(0.5);
        const auto y = world.state(0).x.col(1);
        return y.maxCoeff() - y.minCoeff();
    };
    const double along = length_along_bar(R"("direction": [0, 2, 0])");
    EXPECT_LT(along, 0.997);
    EXPECT_EQ(length_along_bar(R"("along": [[0, 2, 0], [0, 3, 0], [0, 4, 0]])"), along);
    EXPECT_GT(length_along_bar(R"("direction": [1, 0, 0])"), 1.0005);
    EXPECT_GT(length_along_bar(R"("region": {"group": "half"}, "direction": [0, 1, 0])"), along + 1e-3);
    const std::string at = "bodies[0].muscles[0]";
    const auto wrong = [](const std::string& keys) {
        return complaint(with(R"("muscles": [{)" + keys + "}]"));
    };
    EXPECT_EQ(wrong(R"("direction": [1, 0, 0])"), at + ".stress: is missing");
    EXPECT_EQ(wrong(R"("stress": 1, "direction": [0, 0, 0])"), at + ".direction: must not be zero");
    EXPECT_EQ(wrong(R"("stress": 1, "along": [[0, 0, 0], [0, 0, 0]])"),
              at + ".along: must be two points or more, each of three numbers, each apart from the next");
    EXPECT_EQ(wrong(R"("stress": 1, "direction": [1, 0, 0], "factor": [[0, -1]])"),
              at + ".factor: must not be below 0: a muscle only pulls");
}

TEST(Scene, ReadsTendonsAsCordsFromPointToPoint) {
    const auto scene = [](const std::string& tendon) {
        return R"({"bodies": [{"body": "a.h5"}, {"body": "b.h5"}], "tendons": [{)" + tendon + "}]}";
    };
    const SceneSpec spec = parse_scene(
        scene(R"("name": "flexor", "force": 4, "factor": [[0, 0], [1, 0.5]], "through": [{"at": [0, 0, 1]},
                 {"at": [0, 0, 2]}, {"body": "a", "at": [0, 0, 3]}, {"body": "a", "at": [0, 0, 4]}, {"body": "b", "at": [0, 0, 5]}])"),
        "");
    ASSERT_EQ(spec.joints.size(), 3u);  // none from the world to the world
    const std::array<std::array<int, 2>, 3> bodies{{{0, -1}, {0, 0}, {0, 1}}};
    const double from[] = {3, 3, 4}, to[] = {2, 4, 5};
    for (int k = 0; k < 3; ++k) {
        const Joint& joint = spec.joints[k].joint;
        EXPECT_EQ(joint.name, fmt::format("flexor {}", k + 1));
        EXPECT_EQ((std::array{joint.a, joint.b}), bodies[k]);
        const auto& cord = std::get<CordJoint>(joint.kind);
        EXPECT_EQ(cord.from.z(), from[k]);
        EXPECT_EQ(cord.to.z(), to[k]);
        EXPECT_EQ(cord.tension.values, (std::vector<double>{0, 2}));
    }
    const std::string ends = R"("through": [{"body": "a", "at": [0, 0, 1]}, {"at": [0, 0, 2]}])";
    EXPECT_EQ(complaint(scene(ends)), R"(tendons[0]: needs exactly one of "force" and "winch")");
    EXPECT_EQ(complaint(scene(ends + R"(, "force": -1)")),
              "tendons[0].force: is -1, but must be between 0 and 1e30");
    EXPECT_EQ(complaint(scene(ends + R"(, "force": 1, "factor": [[0, -1]])")),
              "tendons[0].factor: must not be below 0: a tendon only pulls");
    EXPECT_EQ(complaint(scene(R"("force": 1, "through": [{"body": "a", "at": [0, 0, 1]}])")),
              "tendons[0].through: must be two points or more");
    EXPECT_EQ(complaint(scene(R"("force": 1, "through": [{"at": [0, 0, 1]}, {"at": [0, 0, 2]}])")),
              "tendons[0].through: must have a point of a body");
    EXPECT_EQ(
        complaint(scene(
            R"("force": 1, "through": [{"body": "a", "at": [0, 0, 1]}, {"body": "b", "at": [0, 0, 1]}])")),
        "tendons[0].through[1].at: is where the point before it is");
    EXPECT_EQ(
        complaint(scene(R"("force": 1, "through": [{"body": "c", "at": [0, 0, 1]}, {"at": [0, 0, 2]}])")),
        R"(tendons[0].through[0].body: no body is named "c"; allowed: a, b; the nearest is "a")");
}

TEST_P(Regions, AreMadeOfRegionsThatAreMadeOfRegions) {
    const std::string box = R"({"box": {"min": [-1, -1, -1], "max": [0.1, 1, 1]}})",
                      ball = R"({"sphere": {"centre": [0, 0, 0], "radius": 0.3}})",
                      low = R"({"box": {"min": [-1, -1, -1], "max": [1, 1, -0.01]}})";
    const auto in_box = [](const Vector3d& p) { return p.x() <= 0.1; };
    const auto in_ball = [](const Vector3d& p) { return p.norm() <= 0.3; };
    const auto is_low = [](const Vector3d& p) { return p.z() <= -0.01; };
    const auto expect = [&](const std::string& region, const std::function<bool(const Vector3d&)>& is_in) {
        const std::vector<int> wanted = rows_where(x, is_in);
        ASSERT_FALSE(wanted.empty()) << region;
        ASSERT_LT(std::ssize(wanted), x.rows()) << region;
        EXPECT_EQ(parts(region), wanted) << region;
    };
    expect(R"({"all": [)" + box + R"(, {"any": [)" + ball + ", " + low + "]}]}",
           [&](const Vector3d& p) { return in_box(p) && (in_ball(p) || is_low(p)); });
    expect(R"({"not": {"any": [)" + ball + ", " + low + "]}}",
           [&](const Vector3d& p) { return !(in_ball(p) || is_low(p)); });
    expect(R"({"not": {"not": )" + ball + "}}", in_ball);
    expect(R"({"any": [{"not": {"all": [)" + box + R"(, {"not": )" + low + "}]}}, " + ball + "]}",
           [&](const Vector3d& p) { return !(in_box(p) && !is_low(p)) || in_ball(p); });
    EXPECT_EQ(parts(R"({"all": [{"any": [{"group": "end"}]}, )" + low + "]}", BodyPart::vertex),
              rows_where(body.surface.X, [&](const Vector3d& p) { return p.x() < -0.499 && is_low(p); }));
}

TEST(NestedRegions, AreEightDeepAtMost) {
    const auto nested = [](int depth) {
        std::string region = R"({"sphere": {"radius": 1}})";
        for (int i = 0; i < depth; ++i) region = R"({"not": )" + region + "}";
        return complaint(with(R"("pins": [)" + region + "]"));
    };
    EXPECT_EQ(nested(8), "");
    EXPECT_EQ(
        nested(9),
        "bodies[0].pins[0].not.not.not.not.not.not.not.not.not: regions are made of regions 9 deep here; "
        "allowed: 8 at most");
    EXPECT_EQ(complaint(with(R"("pins": [{"any": [{"all": []}]}])")),
              "bodies[0].pins[0].any[0].all: must be a list of regions, not empty");
    EXPECT_EQ(
        complaint(with(R"("pins": [{"any": [{"not": {"all": [{"near": {"body": "b", "distance": 1}}]}}]}])"))
            .find("bodies[0].pins[0].any[0].not.all[0].near.body: "),
        0u);
}

}  // namespace
}  // namespace nbd
